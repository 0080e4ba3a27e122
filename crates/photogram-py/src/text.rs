//! Numbers in text; their documentation is in `_photocore.pyi`.

use numpy::PyArray1;
use pyo3::prelude::*;

/// Adds the function to the extension module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(read_numbers, module)?)
}

#[pyfunction]
fn read_numbers<'py>(py: Python<'py>, text: &[u8]) -> (Bound<'py, PyArray1<f64>>, bool) {
    let number =
        |word: &[u8]| str::from_utf8(word).ok()?.parse().ok().filter(|value: &f64| value.is_finite());
    let (numbers, whole): (Vec<f64>, bool) = py.detach(|| {
        let mut words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let mut numbers = Vec::new();
        let bad = words.find(|word| number(word).map(|value| numbers.push(value)).is_none());
        (numbers, bad.is_none())
    });
    (PyArray1::from_vec(py, numbers), whole)
}
