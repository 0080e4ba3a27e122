//! The extension module `photogram._photocore`: converts arrays, releases the GIL, decides nothing.

use pyo3::prelude::*;

#[pymodule]
fn _photocore(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    Ok(())
}
