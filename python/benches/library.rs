//! The fit of `overhead.py` by the library alone: `library TIMES RATES REPEATS` reads float64 as the machine has them, and
//! prints the least time of a fit with its validation in s: as a command on columns in memory, and as calls of functions.
#![forbid(unsafe_code)]

use gyroid::cli::answer;
use gyroid::identify::{FitOptions, fit};
use gyroid::ingest::{Cells, CellsKind, HeldColumn, Loaded, hold};
use gyroid::signal::TimeAxis;
use gyroid::validate::{Options, whiteness};
use std::error::Error;
use std::io::Write;
use std::sync::Arc;
use std::time::Instant;

struct Numbers(Arc<Vec<f64>>);

impl Cells for Numbers {
    fn load(&self) -> gyroid::Result<Loaded> {
        Ok(Loaded::Double(self.0.to_vec()))
    }
}

fn read(path: &str) -> Result<Arc<Vec<f64>>, Box<dyn Error>> {
    let bytes = std::fs::read(path)?;
    let numbers = bytes.chunks_exact(8).map(|b| f64::from_ne_bytes(b.try_into().unwrap_or_default()));
    Ok(Arc::new(numbers.collect()))
}

fn column(name: &str, numbers: &Arc<Vec<f64>>) -> HeldColumn {
    let shape = vec![numbers.len() as u64];
    let cells = Box::new(Numbers(Arc::clone(numbers)));
    HeldColumn { name: name.into(), kind: CellsKind::Number, shape, type_name: "float64".into(), cells }
}

fn least<T>(repeats: usize, mut work: impl FnMut() -> gyroid::Result<T>) -> gyroid::Result<f64> {
    (0..repeats).try_fold(f64::INFINITY, |least, _| {
        let begin = Instant::now();
        work()?;
        Ok(least.min(begin.elapsed().as_secs_f64()))
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().collect();
    let [_, times, rates, repeats] = &args[..] else { return Err("usage: library TIMES RATES REPEATS".into()) };
    let (t_s, rate_rad_s, repeats) = (read(times)?, read(rates)?, repeats.parse()?);
    let command = least(repeats, || {
        let place = hold("arrays", vec![column("t_s", &t_s), column("gyro_z_rad_s", &rate_rad_s)]);
        answer(["gyroid".into(), "fit".into(), place.path().into()], "fit")
    })?;
    let time = TimeAxis::Explicit(t_s.to_vec());
    let functions = least(repeats, || {
        let fit = fit(&time, &rate_rad_s, &FitOptions::default())?;
        let residuals = fit.residuals(&time, &rate_rad_s);
        Ok(whiteness(&time, &residuals, &fit.jacobian(&time), &Options::default()))
    })?;
    writeln!(std::io::stdout(), "{command} {functions}")?;
    Ok(())
}
