//! Golden data, read if available.

// Each test uses a part of the functions.
#![allow(dead_code)]

use serde_json::Value;

/// Returns a file of the golden data for networks; None, with a message, if unavailable.
pub fn golden(name: &str) -> Option<Value> {
    golden_of("network", name)
}

/// Returns a file of the golden data of a folder.
pub fn golden_of(folder: &str, name: &str) -> Option<Value> {
    golden_text(folder, name).map(|text| serde_json::from_str(&text).unwrap())
}

/// Returns the text of a golden file.
pub fn golden_text(folder: &str, name: &str) -> Option<String> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    match std::fs::read_to_string(format!("{path}/{folder}/{name}")) {
        Ok(text) => Some(text),
        Err(error) => {
            eprintln!("skipped: {path}/{folder}/{name}: {error}");
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
