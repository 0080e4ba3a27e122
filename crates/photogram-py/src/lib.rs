//! The extension module `photogram._photocore`: converts arrays, releases the GIL, decides nothing.

mod arrays;
mod attitude;
mod camera;
mod commons;
mod comparator;
mod control_networks;
mod distributions;
mod features;
mod films;
mod geometry;
mod matching;
mod memory;
mod network;
mod observations;
mod options;
mod resection;
mod similarity;
mod solution;
mod stellar;
mod text;
mod trajectories;
mod work;

use pyo3::prelude::*;

#[global_allocator]
static ALLOCATOR: memory::Reserved = memory::Reserved;

#[pymodule]
fn _photocore(module: &Bound<'_, PyModule>) -> PyResult<()> {
    memory::arm()?;
    // Threads are those of the caller's pool: the solvers of the library would start a pool of the whole process beside it.
    faer::set_global_parallelism(faer::Par::Seq);
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(memory::give_back, module)?)?;
    distributions::register(module)?;
    attitude::register(module)?;
    features::register(module)?;
    films::register(module)?;
    geometry::register(module)?;
    camera::register(module)?;
    commons::register(module)?;
    network::register(module)?;
    comparator::register(module)?;
    control_networks::register(module)?;
    resection::register(module)?;
    similarity::register(module)?;
    matching::register(module)?;
    stellar::register(module)?;
    text::register(module)?;
    trajectories::register(module)
}
