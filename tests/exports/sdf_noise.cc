// Loads an SDF file with libsdformat and prints what its IMU's yaw axis got, one `name value` a line.
// Build (Debian: libsdformat-dev): g++ -std=c++17 sdf_noise.cc -o sdf_noise $(pkg-config --cflags --libs sdformat12)
#include <iomanip>
#include <iostream>
#include <sdf/Imu.hh>
#include <sdf/Link.hh>
#include <sdf/Model.hh>
#include <sdf/Noise.hh>
#include <sdf/Root.hh>
#include <sdf/Sensor.hh>

int main(int argc, char **argv)
{
  if (argc != 2)
    return 2;
  sdf::Root root;
  const sdf::Errors errors = root.Load(argv[1]);
  for (const auto &error : errors)
    std::cerr << error << "\n";
  if (!errors.empty() || root.Model() == nullptr)
    return 1;
  const sdf::Sensor *sensor = root.Model()->LinkByIndex(0)->SensorByIndex(0);
  const sdf::Noise &noise = sensor->ImuSensor()->AngularVelocityZNoise();
  std::cout << std::setprecision(17)
            << "update_rate " << sensor->UpdateRate() << "\n"
            << "type " << static_cast<int>(noise.Type()) << "\n"
            << "mean " << noise.Mean() << "\n"
            << "stddev " << noise.StdDev() << "\n"
            << "bias_mean " << noise.BiasMean() << "\n"
            << "bias_stddev " << noise.BiasStdDev() << "\n"
            << "dynamic_bias_stddev " << noise.DynamicBiasStdDev() << "\n"
            << "dynamic_bias_correlation_time " << noise.DynamicBiasCorrelationTime() << "\n"
            << "precision " << noise.Precision() << "\n";
  return 0;
}
