//! A group with one setting of every type, set well and badly.

use super::*;

crate::choice! {
    /// A choice.
    pub enum Order {
        /// One after the other
        Sequential = "sequential",
        /// By a hash
        Hashed = "hashed",
    }
}

crate::settings! {
    /// One of each.
    pub struct Sample {
        /// Rays cast from every element,
        /// by the square grid.
        rays_per_element: u32 = 256, range 16..=1024, unit "rays", paper "256";
        /// Angle.
        feature_angle: f32 = 0.1, range 0.0..=180.0, unit "degrees", paper "not given";
        /// Switch.
        rotate: bool = false, paper "off";
        /// Order.
        order: Order = Order::Sequential, paper "sequential";
        /// No range.
        free: u32 = 7, paper "none";
    }
}

fn set(text: &str) -> Result<Sample, SettingError> {
    Sample::from_assignments(&[Assignment::parse(text)?])
}

#[test]
fn values_of_every_type_are_read() {
    assert_eq!(set("rays_per_element=16").unwrap().rays_per_element, 16);
    assert_eq!(set(" rays-per-element = 1024 ").unwrap().rays_per_element, 1024);
    assert_eq!(set("feature_angle=4.5e1").unwrap().feature_angle, 45.0);
    assert!(set("rotate=on").unwrap().rotate);
    assert_eq!(set("order=hashed").unwrap().order, Order::Hashed);
    assert_eq!(set("free=4294967295").unwrap().free, u32::MAX);
    let twice = ["free=1", "free=2"].map(|text| Assignment::parse(text).unwrap());
    assert_eq!(Sample::from_assignments(&twice).unwrap().free, 2);
}

#[test]
fn errors_say_the_value_seen_and_what_is_allowed() {
    let message = |text: &str| set(text).unwrap_err().to_string();
    assert_eq!(
        message("rays_per_element=8"),
        "rays_per_element=8 is not allowed; rays_per_element is a whole number from 16 to 1024, in rays"
    );
    for value in ["8", "1025", "-1", "1e3", "", "many"] {
        assert!(set(&format!("rays_per_element={value}")).is_err(), "{value:?}");
    }
    for value in ["NaN", "inf", "-0.1", "180.1", ""] {
        assert!(message(&format!("feature_angle={value}")).contains("a number from 0 to 180, in degrees"), "{value:?}");
    }
    assert!(message("rotate=maybe").ends_with("rotate is true or false"));
    assert!(message("order=random").ends_with("order is one of sequential, hashed"));
    assert!(message("rays_per_elemnt=8").ends_with("did you mean rays_per_element?"));
    assert!(message("angle=8").ends_with("did you mean feature_angle?"));
    assert!(message("zzz=8").contains("there are rays_per_element, feature_angle, rotate, order, free"));
    assert!(message("rays").contains("KEY=VALUE"));
    assert!(message("=3").contains("KEY=VALUE"));
}

#[test]
fn specs_and_records_hold_what_was_declared() {
    let specs = Sample::specs();
    assert_eq!(specs.len(), 5);
    assert_eq!(specs[0].doc, "Rays cast from every element, by the square grid.");
    assert_eq!((specs[0].unit, specs[0].paper), ("rays", "256"));
    assert_eq!(specs[0].kind, Kind::Int { min: 16, max: 1024 });
    assert_eq!(specs[4].kind, Kind::Int { min: 0, max: u32::MAX });
    let json = serde_json::to_value(&specs).unwrap();
    assert_eq!(json[3]["type"], "choice");
    assert_eq!(json[3]["values"][1]["name"], "hashed");
    let record = Value::from(Sample::default().record());
    let expected = serde_json::json!({
        "rays_per_element": 256, "feature_angle": 0.1, "rotate": false, "order": "sequential", "free": 7
    });
    assert_eq!(record, expected);
}
