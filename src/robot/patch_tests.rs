use super::model::sum;
use super::read::{choose, models, opened};
use super::xml::Xml;
use super::*;
use crate::error::ErrorKind;

const TWO_WHEELS: &str = include_str!("../../examples/mujoco/robot.xml");

fn finding(truth: Truth) -> Finding {
    Finding { truth, says: "an effect 0.1 [0.05, 0.15]".into() }
}

/// Truths over the robot that the description is of.
fn patched(text: &str, format: Format, truths: &[Truth]) -> Patched {
    let [mass, inertia, ..] = facts(text, format);
    let [all_kg, all_kg_m2] = accelerated(text, format);
    over(text, format, truths, [mass / all_kg, inertia / all_kg_m2])
}

fn over(text: &str, format: Format, truths: &[Truth], shares: [f64; 2]) -> Patched {
    let findings: Vec<Finding> = truths.iter().copied().map(finding).collect();
    patch(text, "robot.xml", format, &Choice::default(), &findings, shares).unwrap()
}

/// M + 2 Jw/r², I + 2 b² Jw/r² of a description.
fn accelerated(text: &str, format: Format) -> [f64; 2] {
    let [mass, inertia, half, radius, wheel, _] = facts(text, format);
    let spin = 2.0 * wheel / (radius * radius);
    [mass + spin, inertia + half * half * spin]
}

fn facts(text: &str, format: Format) -> [f64; 6] {
    let r = parse(text, "robot.xml", format, &Choice::default()).unwrap();
    [r.mass_kg, r.yaw_inertia_kg_m2, r.half_track_m, r.wheel_radius_m, r.wheel_inertia_kg_m2, r.viscous_friction_n_m_s]
        .map(|fact| fact.value.unwrap_or(0.0))
}

#[track_caller]
fn close(found: f64, wanted: f64) {
    assert!((found - wanted).abs() <= 1e-6 * wanted.abs().max(1e-3), "{found} for {wanted}");
}

/// The text without what was added, and with each number replaced by #.
fn skeleton(text: &str) -> String {
    let kept = text.lines().filter(|line| !line.trim_start().starts_with("<!-- gyroid:"));
    let word = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | 'e');
    let mut out = String::new();
    for line in kept {
        for piece in line.split_inclusive(|c: char| !word(c)) {
            let bare = piece.trim_end_matches(|c: char| !word(c));
            out += if bare.parse::<f64>().is_ok() { "#" } else { bare };
            out += &piece[bare.len()..];
        }
        out.push('\n');
    }
    out
}

const ALL: [Truth; 7] = [
    Truth::Radius { left: 0.99, right: 1.005 },
    Truth::Track(1.05),
    Truth::Load { mass: 0.2, inertia: 0.3 },
    Truth::Ahead(0.03),
    Truth::Resistance { coefficient: 0.02, rise: 0.01 },
    Truth::Torque { left: 2.0 / 2.04, right: 2.08 / 2.04 },
    Truth::Slope { slope: 0.02, uphill: 0.8 },
];

#[test]
fn an_mjcf_says_all_that_is_true_and_stays_as_it_was_written() {
    let [mass, inertia, half, radius, wheel, viscous] = facts(TWO_WHEELS, Format::Mjcf);
    let copy = patched(TWO_WHEELS, Format::Mjcf, &ALL);
    assert!(copy.no_place.is_empty(), "{:?}", copy.no_place);
    let after = facts(&copy.text, Format::Mjcf);
    close(after[0], 1.2 * mass);
    close(after[1], 1.3 * inertia);
    close(after[2], 1.05 * half);
    close(after[3], 0.99 * radius);
    close(after[4], wheel);
    // damping of one wheel: rise · weight on it · r²
    let weight = 1.2 * mass * 9.80665 / 2.0;
    close(after[5], viscous + 0.01 * weight * radius * radius);
    let dry = copy.text.split('"').skip_while(|piece| !piece.ends_with("frictionloss=")).nth(1).unwrap();
    close(dry.parse().unwrap(), (0.02 - 0.5 * 0.01) * weight * radius);
    // a thin ellipsoid: its thickness along the axle stays
    assert!(copy.text.contains("size=\"0.065325 0.01625 0.065325\""), "{}", copy.text);
    for gear in ["gear=\"0.980392157\"", "gear=\"1.01960784\""] {
        assert!(copy.text.contains(gear), "{}", copy.text);
    }
    assert_eq!(skeleton(&copy.text), skeleton(TWO_WHEELS));
}

/// A robot that a log told holds the wheels' spin in its mass, whatever the unit of its torques.
#[test]
fn a_load_over_all_that_the_motors_accelerate_is_that_much_more_of_it() {
    let truths = [Truth::Load { mass: 0.2, inertia: 0.3 }, Truth::Ahead(0.03)];
    let copy = over(TWO_WHEELS, Format::Mjcf, &truths, [1.0; 2]);
    let (before, after) = (accelerated(TWO_WHEELS, Format::Mjcf), accelerated(&copy.text, Format::Mjcf));
    close(after[0], 1.2 * before[0]);
    close(after[1], 1.3 * before[1]);
    // the moment m d that couples speed and yaw rate
    let centre = |text: &str| {
        let (document, skipped_rows) = opened(text, "robot.xml").unwrap();
        let xml = Xml { file: "robot.xml", doc: &document, skipped_rows };
        let all = models(&xml, document.root_element(), Format::Mjcf).unwrap();
        let (model, _) = choose(&all, "robot.xml", &Choice::default()).unwrap();
        let (kg, centre, _) = sum(model.links.iter().map(|l| &l.mass)).unwrap();
        kg * centre.x
    };
    close(centre(&copy.text) - centre(TWO_WHEELS), 0.03 * 1.2 * before[0]);
}

#[test]
fn an_mjcf_without_findings_is_the_same_to_the_byte() {
    assert_eq!(patched(TWO_WHEELS, Format::Mjcf, &[]).text, TWO_WHEELS);
    let odd = format!("\u{feff}\n\n{}", TWO_WHEELS[TWO_WHEELS.find("<mujoco").unwrap()..].replace('\n', "\r\n"));
    let copy = patched(&odd, Format::Mjcf, &[Truth::Torque { left: 0.95, right: 1.05 }]);
    assert!(copy.text.starts_with("\u{feff}\n\n<mujoco"));
    assert_eq!(copy.text.matches('\n').count(), copy.text.matches("\r\n").count() + 2);
    assert_eq!(skeleton(&copy.text), skeleton(&odd));
}

/// A rover in URDF, whose wheel links are turned as CAD programs leave them.
fn urdf() -> String {
    let wheel = |name: &str, y: f64| {
        format!(
            r#"
  <joint name="{name}_wheel" type="continuous">
    <origin xyz="0 {y} 0.02" rpy="-1.5707963267948966 0 0"/>
    <parent link="base"/> <child link="{name}"/>
    <axis xyz="0 0 1"/>
  </joint>
  <link name="{name}">
    <collision><geometry><cylinder radius="0.05" length="0.02"/></geometry></collision>
    <inertial><mass value="0.5"/><inertia ixx="0.0004" iyy="0.0004" izz="0.0006"/></inertial>
  </link>"#
        )
    };
    let plugin = "<gazebo><plugin name=\"drive\"><left_joint>left_wheel</left_joint><right_joint>right_wheel</right_joint>\
                  <wheel_radius>0.05</wheel_radius><wheel_separation>0.4</wheel_separation></plugin></gazebo>";
    format!(
        r#"<robot name="rover">
  <link name="base"><inertial><origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/><mass value="4"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial></link>{}{}
  {plugin}
</robot>"#,
        wheel("left", 0.2),
        wheel("right", -0.2)
    )
}

#[test]
fn a_urdf_keeps_what_its_controller_believes() {
    let text = urdf();
    let before = facts(&text, Format::Urdf);
    let copy = patched(&text, Format::Urdf, &ALL);
    let after = facts(&copy.text, Format::Urdf);
    for (found, wanted) in after.iter().zip([1.2, 1.3, 1.05, 0.99].iter().zip(before).map(|(over, had)| over * had)) {
        close(*found, wanted);
    }
    assert!(copy.text.contains("<wheel_radius>0.05</wheel_radius><wheel_separation>0.4</wheel_separation>"));
    assert!(copy.text.contains("<dynamics damping="), "{}", copy.text);
    // the world and the motors are not in a URDF
    let why: Vec<&str> = copy.no_place.iter().map(|(_, why)| why.as_str()).collect();
    assert!(matches!(why[..], [motor, world] if motor.contains("motor") && world.contains("world")), "{why:?}");
    // the axle moves down with the radius: 1 % of 0.05 m
    assert!(copy.text.contains("xyz=\"0 0.21 0.0195\""), "{}", copy.text);
}

const SDF: &str = r#"<sdf version="1.9"><world name="w">
  <gravity>0 0 -9.8</gravity>
  <model name="rover">
    <link name="base"><inertial><pose>0.05 0 0.1 0 0 0</pose><mass>4</mass><inertia><ixx>0.02</ixx><iyy>0.03</iyy><izz>0.04</izz></inertia></inertial></link>
    <link name="left"><pose relative_to="__model__">0 0.2 0.05 -1.5707963267948966 0 0</pose>
      <inertial><mass>0.5</mass><inertia><ixx>0.0004</ixx><iyy>0.0004</iyy><izz>0.0006</izz></inertia></inertial>
      <collision name="c"><geometry><cylinder><radius>0.05</radius><length>0.02</length></cylinder></geometry></collision></link>
    <link name="right"><pose>0 -0.2 0.05 -1.5707963267948966 0 0</pose>
      <inertial><mass>0.5</mass><inertia><ixx>0.0004</ixx><iyy>0.0004</iyy><izz>0.0006</izz></inertia></inertial>
      <collision name="c"><geometry><cylinder><radius>0.05</radius><length>0.02</length></cylinder></geometry></collision></link>
    <joint name="left_wheel" type="revolute"><parent>base</parent><child>left</child><axis><xyz>0 0 1</xyz></axis></joint>
    <joint name="right_wheel" type="revolute"><parent>base</parent><child>right</child><axis><xyz>0 0 1</xyz><dynamics><damping>0.001</damping></dynamics></axis></joint>
    <plugin filename="gz-sim-diff-drive-system" name="gz::sim::systems::DiffDrive"><left_joint>left_wheel</left_joint>
      <right_joint>right_wheel</right_joint><wheel_radius>0.05</wheel_radius><wheel_separation>0.4</wheel_separation></plugin>
  </model></world></sdf>"#;

#[test]
fn an_sdf_tilts_its_world() {
    let before = facts(SDF, Format::Sdf);
    let copy = patched(SDF, Format::Sdf, &ALL);
    let after = facts(&copy.text, Format::Sdf);
    for (found, wanted) in after.iter().zip([1.2, 1.3, 1.05, 0.99].iter().zip(before).map(|(over, had)| over * had)) {
        close(*found, wanted);
    }
    let gravity = copy.text.split(['<', '>']).skip_while(|piece| *piece != "gravity").nth(1).unwrap();
    let gravity: Vec<f64> = gravity.split(' ').map(|word| word.parse().unwrap()).collect();
    close(gravity[0], -9.8 * 0.02_f64.sin() * 0.8_f64.cos());
    close(gravity[1], -9.8 * 0.02_f64.sin() * 0.8_f64.sin());
    close(gravity[2], -9.8 * 0.02_f64.cos());
    assert!(copy.text.contains("<wheel_radius>0.05</wheel_radius><wheel_separation>0.4</wheel_separation>"));
    assert_eq!(copy.no_place.len(), 1, "{:?}", copy.no_place);
    // damping that was there grows, and is put in where there was none
    assert_eq!(copy.text.matches("<damping>").count(), 2);
    assert_eq!(copy.text.matches("<friction>").count(), 2);
}

#[test]
fn wheels_that_come_out_unlike_are_still_checked() {
    let copy = patched(TWO_WHEELS, Format::Mjcf, &[Truth::Radius { left: 1.1, right: 1.0 }]);
    assert!(copy.text.contains("size=\"0.0715 0.01625 0.0715\"") && copy.text.contains("pos=\"0 0.17 0.0065\""));
    assert!(copy.text.contains("pos=\"0 -0.17 0\""), "the other wheel stays");
}

#[test]
fn what_has_no_place_changes_nothing() {
    let speed = TWO_WHEELS.replace("<general ", "<velocity ");
    let copy = patched(&speed, Format::Mjcf, &[Truth::Torque { left: 0.95, right: 1.05 }]);
    assert_eq!((copy.text.as_str(), copy.changes.len()), (speed.as_str(), 0));
    assert!(copy.no_place[0].1.contains("holds a position or a speed"));
    let shapes = TWO_WHEELS.replace("angle=\"radian\"", "angle=\"radian\" inertiafromgeom=\"true\"");
    let shapes = shapes.replace("mass=\"0\"", "mass=\"1\"");
    let copy = patched(&shapes, Format::Mjcf, &[Truth::Load { mass: 0.1, inertia: 0.1 }]);
    assert!(copy.no_place[0].1.contains("comes from its shapes"), "{:?}", copy.no_place);
    assert_eq!(copy.text, shapes);
    // half the robot taken away is more than the chassis can give
    let copy = patched(TWO_WHEELS, Format::Mjcf, &[Truth::Load { mass: -0.95, inertia: 0.0 }]);
    assert!(copy.no_place[0].1.contains("no mass left"), "{:?}", copy.no_place);
}

#[test]
fn a_comment_ends_where_it_should_and_a_broken_file_is_refused() {
    let findings = [Finding { truth: Truth::Torque { left: 0.95, right: 1.05 }, says: "odd -- words -->".into() }];
    let copy = patch(TWO_WHEELS, "robot.xml", Format::Mjcf, &Choice::default(), &findings, [1.0; 2]).unwrap();
    assert!(roxmltree::Document::parse(&copy.text).is_ok(), "{}", copy.text);
    let cut = &TWO_WHEELS[..TWO_WHEELS.len() / 2];
    let error = patch(cut, "robot.xml", Format::Mjcf, &Choice::default(), &findings, [1.0; 2]).unwrap_err();
    assert_eq!(error.kind, ErrorKind::Format);
}
