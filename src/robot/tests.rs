use super::*;
use crate::config::Steering;
use crate::error::Result;

fn read(text: &str, format: Format) -> Result<Robot> {
    parse(text, "robot.xml", format, &Choice::default())
}

fn close(fact: &Fact, value: f64) {
    let found = fact.value.unwrap_or_else(|| panic!("not told: {}", fact.source));
    assert!((found - value).abs() <= 1e-5 * value.abs(), "{found} for {value}: {}", fact.source);
}

#[track_caller]
fn refused(result: Result<Robot>, parts: &[&str]) {
    let text = result.map(|r| format!("{r:?}")).unwrap_err().to_string();
    parts.iter().for_each(|part| assert!(text.contains(part), "{text} lacks {part}"));
}

/// Wheel joint and link of a URDF, at x and y, turned as CAD programs leave them.
fn wheel(name: &str, x: f64, y: f64, kind: &str) -> String {
    format!(
        r#"<joint name="{name}_joint" type="{kind}"><parent link="base"/><child link="{name}"/>
             <origin xyz="{x} {y} 0.02" rpy="-1.5707963267948966 0 0"/><axis xyz="0 0 1"/></joint>
           <link name="{name}"><collision><geometry><cylinder radius="0.05" length="0.02"/></geometry></collision>
             <inertial><mass value="0.5"/><inertia ixx="0.0004" iyy="0.0004" izz="0.0006"/></inertial></link>"#
    )
}

fn urdf(inside: &str) -> String {
    format!(
        r#"<robot name="rover"><link name="base"><inertial><origin xyz="0.1 0 0"/><mass value="4"/>
             <inertia ixx="0.02" iyy="0.03" izz="0.04"/></inertial></link>{inside}</robot>"#
    )
}

fn two_wheels() -> String {
    wheel("left_wheel", 0.0, 0.2, "continuous") + &wheel("right_wheel", 0.0, -0.2, "continuous")
}

#[test]
fn a_robot_on_two_wheels_is_measured() {
    let castor = r#"<joint name="castor_swivel" type="continuous"><parent link="base"/><child link="fork"/><origin xyz="0.3 0 0"/>
        <axis xyz="0 0 1"/></joint><link name="fork"/>
        <joint name="castor_wheel_joint" type="continuous"><parent link="fork"/><child link="castor_wheel"/><axis xyz="0 1 0"/></joint>
        <link name="castor_wheel"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>"#;
    let robot = read(&urdf(&(two_wheels() + castor)), Format::Urdf).unwrap();
    assert_eq!(
        (&robot.left[..], &robot.right[..]),
        (&["left_wheel_joint".into()][..], &["right_wheel_joint".into()][..])
    );
    assert_eq!(robot.steering, Steering::Differential);
    close(&robot.mass_kg, 5.0);
    close(&robot.half_track_m, 0.2);
    close(&robot.wheel_radius_m, 0.05);
    close(&robot.wheel_inertia_kg_m2, 0.0006);
    // centre of mass at x = 0.08; a wheel that is turned onto its axle has its ixx about the vertical
    close(&robot.yaw_inertia_kg_m2, 0.04 + 4.0 * 0.02 * 0.02 + 2.0 * (0.0004 + 0.5 * (0.2 * 0.2 + 0.08 * 0.08)));
    assert!(robot.notes.iter().any(|n| n.contains("weightless: 2 of 5")), "{:?}", robot.notes);
    assert_eq!(robot.viscous_friction_n_m_s.value, None);
}

#[test]
fn four_wheels_skid_and_unlike_ones_are_asked_for() {
    let four = |names: [&str; 4]| {
        let places = [(0.2, 0.3), (-0.2, 0.3), (0.2, -0.3), (-0.2, -0.3)];
        names.iter().zip(places).map(|(n, (x, y))| wheel(n, x, y, "continuous")).collect::<String>()
    };
    let robot = read(&urdf(&four(["fl_wheel", "rl_wheel", "fr_wheel", "rr_wheel"])), Format::Urdf).unwrap();
    assert_eq!((robot.left.len(), robot.right.len(), robot.steering), (2, 2, Steering::Skid));
    close(&robot.half_track_m, 0.3);
    close(&robot.wheel_inertia_kg_m2, 2.0 * 0.0006);
    // a transmission says which are driven
    let driven = |j: &str| format!(r#"<transmission name="t{j}"><joint name="{j}_joint"/></transmission>"#);
    let text = four(["fl_wheel", "rl_wheel", "fr_wheel", "rr_wheel"]) + &driven("rl_wheel") + &driven("rr_wheel");
    let robot = read(&urdf(&text), Format::Urdf).unwrap();
    assert_eq!((&robot.left[..], robot.steering), (&["rl_wheel_joint".to_string()][..], Steering::Differential));
    let three = two_wheels() + &wheel("rear_wheel", -0.3, 0.0, "continuous");
    refused(
        read(&urdf(&three), Format::Urdf),
        &["rover", "1 wheels lie left, 1 right and 1 between them", "rear_wheel_joint at x -0.300", "--left-wheel"],
    );
    let choice = Choice { left: vec!["left_wheel".into()], right: vec!["right_wheel_joint".into()], model: None };
    let robot = parse(&urdf(&three), "r.urdf", Format::Urdf, &choice).unwrap();
    assert_eq!(robot.left, ["left_wheel_joint"]);
    let choice = Choice { left: vec!["lft_wheel_joint".into()], ..choice };
    refused(
        parse(&urdf(&three), "r.urdf", Format::Urdf, &choice),
        &["no joint lft_wheel_joint", "did you mean left_wheel_joint?"],
    );
    let large = three.replacen("0.05", "0.08", 1).replace("rear_wheel", "rear_caster");
    refused(read(&urdf(&large), Format::Urdf), &["different sizes, radii 0.05 to 0.08 m"]);
}

#[test]
fn what_is_no_such_robot_is_refused_with_the_mend() {
    refused(read(&urdf(""), Format::Urdf), &["no driven wheels", "no joints that move"]);
    refused(
        read(&urdf(&two_wheels().replace("continuous", "revolute")), Format::Urdf),
        &["no driven wheels", "continuous", "left_wheel_joint"],
    );
    let steered = two_wheels()
        + r#"<joint name="steer_left" type="revolute"><parent link="base"/><child link="hinge"/><axis xyz="0 0 1"/></joint><link name="hinge"/>"#
        + &wheel("front_wheel", 0.3, 0.0, "continuous").replace(r#"link="base""#, r#"link="hinge""#);
    refused(read(&urdf(&steered), Format::Urdf), &["steer_left steers the wheel of front_wheel_joint"]);
    let omni = two_wheels().replace("left_wheel", "left_mecanum_wheel");
    refused(read(&urdf(&omni), Format::Urdf), &["rolls sideways"]);
    refused(read(&urdf("<joint"), Format::Urdf), &["robot.xml", "is no XML"]);
    refused(
        read("<robot name='a'><xacro:include filename='b'/></robot>", Format::Urdf),
        &["xacro", "xacro ROBOT.urdf.xacro -o robot.urdf"],
    );
    let macros = "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'><xacro:property name='a' value='1'/></robot>";
    refused(read(macros, Format::Urdf), &["line 1", "xacro is not expanded here"]);
    refused(
        read(&urdf(&two_wheels().replace("0 0.2 0.02", "0 ${track} 0.02")), Format::Urdf),
        &["is not expanded", "xacro"],
    );
    refused(
        read(&urdf(&two_wheels().replace("0.5\"", "heavy\"")), Format::Urdf),
        &["line", "<mass>", "heavy", "a number"],
    );
    refused(read(&urdf(""), Format::Sdf), &["is URDF (<robot>), not SDF", "--urdf robot.xml"]);
    let late = format!("\n\n<?xml version='1.0'?>\n{}", urdf(&two_wheels().replace("0.5\"", "heavy\"")));
    refused(read(&late, Format::Urdf), &["line 8, <mass>"]);
    refused(read("<launch/>", Format::Urdf), &["launch file"]);
    refused(read("<html/>", Format::Mjcf), &["begins with <html>", "<mujoco>"]);
    refused(read("<sdf version='1.7'><world name='w'/></sdf>", Format::Sdf), &["no robot that could move"]);
}

/// A model of SDF with two wheels and the plugin of Gazebo Sim.
fn model(name: &str) -> String {
    let wheel = |side: &str, y: f64| {
        format!(
            "<link name='{side}'><pose>0 {y} 0.1 -1.5707963267948966 0 0</pose><inertial><mass>1</mass><inertia><ixx>0.002</ixx>\
             <iyy>0.002</iyy><izz>0.003</izz></inertia></inertial><visual name='v'><geometry><mesh><uri>w.dae</uri></mesh></geometry>\
             </visual></link><joint name='{side}_hinge' type='revolute'><parent>base</parent><child>{side}</child><axis><xyz>0 0 1</xyz>\
             <limit><lower>-1e16</lower><upper>1e16</upper></limit><dynamics><damping>0.2</damping></dynamics></axis></joint>"
        )
    };
    format!(
        "<model name='{name}'><link name='base'><inertial><mass>6</mass><inertia><izz>0.2</izz></inertia></inertial><sensor name='imu' \
         type='imu'><update_rate>100</update_rate><imu><angular_velocity><z><noise type='gaussian'><stddev>0.001</stddev></noise></z>\
         </angular_velocity></imu></sensor></link>{}{}<plugin filename='gz-sim-diff-drive-system' name='gz::sim::systems::DiffDrive'>\
         <left_joint>l_hinge</left_joint><right_joint>r_hinge</right_joint><wheel_separation>0.5</wheel_separation>\
         <wheel_radius>0.1</wheel_radius></plugin></model>",
        wheel("l", 0.2),
        wheel("r", -0.2)
    )
}

#[test]
fn sdf_is_read_with_its_plugin_and_its_imu() {
    let ground = "<model name='ground'><static>true</static><link name='l'/></model>";
    let robot =
        read(&format!("<sdf version='1.9'><world name='w'>{ground}{}</world></sdf>", model("blue")), Format::Sdf)
            .unwrap();
    assert_eq!((robot.name.as_str(), &robot.left[..]), ("blue", &["l_hinge".to_string()][..]));
    close(&robot.mass_kg, 8.0);
    close(&robot.yaw_inertia_kg_m2, 0.2 + 2.0 * (0.002 + 0.04));
    close(&robot.half_track_m, 0.2);
    close(&robot.wheel_radius_m, 0.1);
    close(&robot.wheel_inertia_kg_m2, 0.003);
    close(&robot.viscous_friction_n_m_s, 0.2);
    assert!(robot.wheel_radius_m.source.contains("gz::sim::systems::DiffDrive"));
    assert!(
        robot.notes.iter().any(|n| n.contains("0.4000 m by the links, and 0.5000 m for the plugin")),
        "{:?}",
        robot.notes
    );
    close(&robot.gyro_rate_hz.unwrap(), 100.0);
    close(&robot.gyro_noise_std_rad_s.unwrap(), 0.001);
}

#[test]
fn of_several_models_one_is_to_be_named() {
    let text = format!("<sdf version='1.9'><world name='w'>{}{}</world></sdf>", model("blue"), model("green"));
    refused(read(&text, Format::Sdf), &["holds 2 robots with driven wheels: blue, green", "--model blue"]);
    let named =
        |name: &str| parse(&text, "w.sdf", Format::Sdf, &Choice { model: Some(name.into()), ..Choice::default() });
    assert_eq!(named("green").unwrap().name, "green");
    refused(named("gren"), &["has no robot gren", "did you mean green?"]);
}

#[test]
fn frames_of_sdf_are_followed_and_circles_are_refused() {
    let text = model("blue").replace(
        "<link name='l'><pose>0 0.2",
        "<frame name='side'><pose>0 0.15 0 0 0 0</pose></frame><link name='l'><pose relative_to='side'>0 0.05",
    );
    let robot = read(&format!("<sdf version='1.9'>{text}</sdf>"), Format::Sdf).unwrap();
    close(&robot.half_track_m, 0.2);
    let circle = text.replace("<frame name='side'><pose>", "<frame name='side'><pose relative_to='side'>");
    refused(read(&format!("<sdf version='1.9'>{circle}</sdf>"), Format::Sdf), &["in a circle"]);
    // until 1.4 an axis has the model's axes
    let old = model("blue")
        .replace("<xyz>0 0 1</xyz>", "<xyz>0 1 0</xyz>")
        .replace("<plugin", "<other")
        .replace("</plugin>", "</other>");
    let old = old
        .replace("name='l'", "name='l_wheel'")
        .replace("<child>l<", "<child>l_wheel<")
        .replace("name='r'", "name='r_wheel'")
        .replace("<child>r<", "<child>r_wheel<");
    assert!(read(&format!("<sdf version='1.4'>{old}</sdf>"), Format::Sdf).is_ok());
    refused(read(&format!("<sdf version='1.6'>{old}</sdf>"), Format::Sdf), &["no driven wheels"]);
}

/// A robot in MJCF, whose masses come from its shapes.
const MJCF: &str = r#"<mujoco model="rover">
  <default><default class="wheel"><geom type="cylinder" size="0.1 0.04"/><joint axis="0 1 0" damping="0.1" armature="0.001"/></default></default>
  <worldbody><geom type="plane" size="10 10 0.1"/>
    <body name="chassis" pos="0 0 0.1"><freejoint/><geom type="box" size="0.2 0.15 0.05" mass="2.0"/>
      <body name="left" pos="-0.1 0.2 0" childclass="wheel"><joint name="l"/><geom euler="90 0 0"/></body>
      <body name="right" pos="-0.1 -0.2 0" childclass="wheel"><joint name="r"/><geom euler="90 0 0"/></body>
      <body name="castor" pos="0.15 0 -0.05"><geom type="sphere" size="0.05"/></body>
      <body name="arm"><joint name="lift" axis="0 1 0"/><geom type="capsule" size="0.01" fromto="0 0 0 0.1 0 0" mass="0"/></body>
    </body></worldbody>
  <actuator><velocity joint="l"/><velocity joint="r"/></actuator></mujoco>"#;

#[test]
fn mjcf_has_the_masses_that_mujoco_gives_it() {
    // by MuJoCo 4.0: mj_forward, subtree mass, and the bodies' inertias about the common centre of mass
    let robot = read(MJCF, Format::Mjcf).unwrap();
    close(&robot.mass_kg, 7.550_147_021);
    close(&robot.yaw_inertia_kg_m2, 0.296_722_000);
    close(&robot.half_track_m, 0.2);
    close(&robot.wheel_radius_m, 0.1);
    close(&robot.wheel_inertia_kg_m2, 0.012_566_37 + 0.001);
    close(&robot.viscous_friction_n_m_s, 0.1);
    assert_eq!((&robot.left[..], &robot.right[..]), (&["l".to_string()][..], &["r".to_string()][..]));
}

#[test]
fn a_mesh_without_a_mass_is_not_weighed_by_guess() {
    let text = MJCF.replace(r#"type="box" size="0.2 0.15 0.05" mass="2.0""#, r#"type="mesh" mesh="hull""#);
    let robot = read(&text, Format::Mjcf).unwrap();
    assert_eq!(robot.mass_kg.value, None);
    assert!(robot.mass_kg.source.contains("hull is a mesh") && robot.mass_kg.source.contains("weigh the robot"));
    close(&robot.half_track_m, 0.2);
    let capsule = MJCF.replace(r#"type="sphere" size="0.05""#, r#"type="capsule" size="0.03 0.05" mass="1""#);
    // a capsule along z: tube and two halves of a ball
    let (tube, ball) = (0.1 / 0.14, 0.04 / 0.14);
    let own = tube * 0.5 * 0.03 * 0.03 + ball * 0.4 * 0.03 * 0.03;
    let heavier = read(&capsule, Format::Mjcf).unwrap();
    let point =
        read(&MJCF.replace(r#"type="sphere" size="0.05""#, r#"type="sphere" size="0.05" mass="1""#), Format::Mjcf)
            .unwrap();
    let gained = heavier.yaw_inertia_kg_m2.value.unwrap() - point.yaw_inertia_kg_m2.value.unwrap();
    assert!((gained - (own - 0.4 * 0.05 * 0.05)).abs() < 1e-12, "{gained}");
}

#[test]
fn a_hostile_file_is_an_error() {
    let deep = format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", "<body>".repeat(300), "</body>".repeat(300));
    refused(read(&deep, Format::Mjcf), &["too deep"]);
    let looped = urdf(
        r#"<link name="a"/><link name="b"/><joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>
        <joint name="k" type="continuous"><parent link="b"/><child link="a"/></joint>"#,
    );
    assert!(read(&looped, Format::Urdf).is_err());
    for cut in (0..MJCF.len()).step_by(37).filter(|c| MJCF.is_char_boundary(*c)) {
        assert!(read(&MJCF[..cut], Format::Mjcf).is_err());
    }
}
