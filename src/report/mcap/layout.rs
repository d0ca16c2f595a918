//! A layout for Foxglove that shows a recording: the path in three dimensions, plots over time, the verdict as it is.

use crate::files::mark;
use serde_json::{Value, json};

/// Topics of a recording that decide what its layout shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shown {
    /// Of the filter over a drive.
    Navigation,
    /// Of a diagnosis; whether it is of a drive.
    Gap {
        /// A drive, and no gyro at rest.
        drive: bool,
    },
    /// Of a noise model.
    Noise,
}

/// The layout, as Foxglove's "Import from file" takes it.
#[must_use]
pub(crate) fn layout(shown: Shown) -> Value {
    match shown {
        Shown::Navigation => tiled(
            [
                scene("map", &["/odom", "/reference", "/pose/without_error_model"]),
                plot("Gyro, rad/s", &["/imu/data_raw.angular_velocity.z", "/imu/data.angular_velocity.z"]),
                plot("Gyro error, rad/s", &["/bias.twist.twist.angular.z"]),
                plot(
                    "Innovations, standard deviations",
                    &["gyro", "wheel_left", "wheel_right"].map(|s| format!("/gyroid/innovation/{s}.standardised")),
                ),
            ],
            raw("/gyroid/verdict"),
        ),
        Shown::Gap { drive: true } => {
            let channel = |name: &str| {
                let of = |side: &str| format!("/gyroid/compared/{name}.{side}");
                plot(name, &["recorded", "before", "after"].map(of))
            };
            tiled(
                [
                    scene("map", &["/pose/recorded", "/pose/before", "/pose/after"]),
                    channel("gyro_z_rad_s"),
                    channel("wheel_left_rad_s"),
                    channel("wheel_right_rad_s"),
                ],
                raw("/gyroid/verdict"),
            )
        }
        Shown::Gap { drive: false } => {
            let of = |part: &str| format!("/gyroid/band/deviation.{part}");
            let parts = ["recorded", "before_low", "before_high", "after_low", "after_high"].map(of);
            two(plot("Deviation, rad/s", &parts), raw("/gyroid/curve"), raw("/gyroid/verdict"))
        }
        Shown::Noise => two(
            plot("Gyro, rad/s", &["/imu/data_raw.angular_velocity.z"]),
            raw("/gyroid/curve"),
            raw("/gyroid/verdict"),
        ),
    }
}

/// A panel: its type, and its settings.
type Panel = (&'static str, Value);

fn plot<S: AsRef<str>>(title: &str, paths: &[S]) -> Panel {
    let path = |p: &S| json!({ "value": p.as_ref(), "enabled": true, "timestampMethod": "receiveTime" });
    let settings = json!({
        "title": title,
        "foxglovePanelTitle": title,
        "paths": paths.iter().map(path).collect::<Vec<_>>(),
        "xAxisVal": "timestamp",
        "showLegend": true,
        "isSynced": true,
    });
    ("Plot", settings)
}

fn scene(frame: &str, topics: &[&str]) -> Panel {
    let shown = |topic: &&str| ((*topic).to_string(), json!({ "visible": true }));
    let settings = json!({
        "followTf": frame,
        "followMode": "follow-none",
        "topics": topics.iter().map(shown).collect::<serde_json::Map<_, _>>(),
        "layers": { "grid": { "layerId": "foxglove.Grid", "visible": true, "size": 20, "divisions": 20 } },
    });
    ("3D", settings)
}

fn raw(topic: &str) -> Panel {
    ("RawMessages", json!({ "topicPath": topic, "expansion": "all" }))
}

/// Four panels in two columns, and one below them.
fn tiled([a, b, c, d]: [Panel; 4], below: Panel) -> Value {
    let panels = [a, b, c, d, below];
    let ids = ids(&panels);
    let column = |first: &str, second: &str| json!({ "direction": "column", "first": first, "second": second });
    let above = json!({ "direction": "row", "first": column(&ids[0], &ids[1]), "second": column(&ids[2], &ids[3]) });
    let tree = json!({ "direction": "column", "first": above, "second": ids[4], "splitPercentage": 75 });
    whole(&panels, &ids, &tree)
}

/// One panel above two.
fn two(above: Panel, left: Panel, right: Panel) -> Value {
    let panels = [above, left, right];
    let ids = ids(&panels);
    let below = json!({ "direction": "row", "first": ids[1], "second": ids[2] });
    whole(&panels, &ids, &json!({ "direction": "column", "first": ids[0], "second": below }))
}

fn ids(panels: &[Panel]) -> Vec<String> {
    (1..).zip(panels).map(|(i, (kind, _))| format!("{kind}!gyroid{i}")).collect()
}

fn whole(panels: &[Panel], ids: &[String], tree: &Value) -> Value {
    let by_id: serde_json::Map<_, _> =
        ids.iter().cloned().zip(panels.iter().map(|(_, settings)| settings.clone())).collect();
    json!({
        "schema": mark::json_schema("layout"),
        "configById": by_id,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": { "speed": 1 },
        "layout": tree,
    })
}
