//! Golden data for networks, read where they are at hand.

// Each test takes what it needs.
#![allow(dead_code)]

use serde_json::Value;

/// A file of the golden data; None, visibly, where they are not at hand.
pub fn golden(name: &str) -> Option<Value> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/network/");
    match std::fs::read_to_string(format!("{path}{name}")) {
        Ok(text) => Some(serde_json::from_str(&text).unwrap()),
        Err(error) => {
            eprintln!("skipped: {path}{name}: {error}");
            None
        }
    }
}

/// Numbers.
pub fn list(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
}

/// Rows of numbers.
pub fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(list).collect()
}
