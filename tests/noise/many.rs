//! `gyroid noise` of many logs, as those who have many gyros run it.

use crate::place::Place;
use serde_json::Value;

/// Three gyros; N of the last one is twice that of the others, and one log is no log.
fn gyros() -> Place {
    let place = Place::with(&[]);
    std::fs::create_dir_all(place.path("logs")).unwrap();
    for (gyro, n) in [1e-4, 1.1e-4, 2e-4].into_iter().enumerate() {
        let toml = format!(
            "schema = 1\nkind = \"stationary\"\nsample_time_s = 0.1\n[gyro]\nc1_rad_s = 2e-3\nc2_rad_s = -5e-3\n\
             time_constant_s = 60.0\nangle_random_walk_rad_sqrt_s = {n:e}\n"
        );
        place.write("gyro.toml", &toml);
        place.ok(&format!("simulate gyro.toml --duration 900 --seed {gyro} -o logs/{gyro}.csv"));
    }
    place.write("logs/torn.csv", "t_s,gyro_z_rad_s\n1,x\n");
    place
}

#[test]
fn a_table_of_gyros_tells_each_term_and_how_it_differs() {
    let place = gyros();
    let text = place.unfit("noise logs --draws 99 --results one.parquet --json one.json");
    assert!(text.contains("N   in 3 of 3: mean") && text.contains("torn.csv") && text.contains("error:"), "{text}");
    let answer: Value = serde_json::from_str(&place.read("one.json")).unwrap();
    let rows = answer["rows"].as_array().unwrap();
    for (row, n) in rows.iter().zip([1e-4, 1.1e-4, 2e-4]) {
        let number = |name: &str| row[name].as_f64().unwrap();
        let (size, std) = (number("angle_random_walk_rad_sqrt_s"), number("angle_random_walk_std_rad_sqrt_s"));
        assert!((size - n).abs() < 4.0 * std && row["terms"] == "N" && row["fits"] == true, "{row}");
        // what the log does not show has a bound, and no size
        assert!(
            row["rate_random_walk_rad_s_sqrt_s"].is_null() && number("rate_random_walk_upper95_rad_s_sqrt_s") > 0.0
        );
    }
    // ln 2e-4, and twice ln 1e-4 or so: the standard deviation of these three is 0.37
    let term = &answer["populations"][0]["terms"][0];
    assert_eq!((term["id"].as_str(), term["found"].as_u64()), (Some("angle_random_walk"), Some(3)));
    let spread = term["relative_spread"].as_f64().unwrap();
    assert!((0.3..0.45).contains(&spread), "{term}");
    // one log alone says the same
    place.ok("noise logs/1.csv --draws 99 --json alone.json");
    let alone: Value = serde_json::from_str(&place.read("alone.json")).unwrap();
    assert_eq!(alone["terms"][0]["estimate"], rows[1]["angle_random_walk_rad_sqrt_s"]);
    assert_eq!(alone["goodness"]["p_value"], rows[1]["goodness_p_value"]);

    for part in 1..=2 {
        place.run(&format!("noise logs --draws 99 --shard {part}/2 -o part_{part}.parquet"));
    }
    let merged = place.unfit("merge part_2.parquet part_1.parquet part_1.parquet -o all.parquet");
    assert!(merged.contains("wrote all.parquet: 4 rows of 3 parts"), "{merged}");
    let [all, one] = ["all.parquet", "one.parquet"].map(|name| std::fs::read(place.path(name)).unwrap());
    assert!(all == one);
    // rows that are there are taken over
    let again = place.unfit("noise logs --draws 99 --results one.parquet --resume");
    assert!(again.contains("1 read, 3 taken from the results; 1 failed"), "{again}");
}

#[test]
fn what_is_of_one_log_is_refused_of_many() {
    let place = gyros();
    for option in ["--plot a.png", "--html a.html", "--datasheet MPU-6050", "--write gyro.toml"] {
        place.refused(&format!("noise logs {option}"), 2, &["for one log", "hint"]);
    }
    place.refused("noise logs/0.csv -o terms.toml", 2, &["--out", "--write"]);
    place.refused("merge a.parquet -o b.parquet --config c.toml", 1, &["a.parquet"]);
    place.run("noise logs --draws 99 --results noise.csv");
    place.refused("merge noise.csv -o all.csv --config c.toml", 2, &["--config", "gyroid fit"]);
}
