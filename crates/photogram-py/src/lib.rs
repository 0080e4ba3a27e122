//! Extension module `photogram._photocore`: converts arrays, releases the GIL, and contains no further logic.

mod adjustment;
mod arrays;
mod attitude;
mod camera;
mod commons;
mod comparator;
mod control_networks;
mod distributions;
mod geometry;
mod memory;
mod network;
mod observations;
mod resection;
mod similarity;
mod stellar;
mod text;
mod trajectories;
mod work;

#[global_allocator]
static ALLOCATOR: memory::Reserved = memory::Reserved;

/// Python interface of the core.
#[pyo3::pymodule]
mod _photocore {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::adjustment::{is_chord, judge_full_step, step_rules};
    #[pymodule_export]
    use crate::attitude::{attitudes_from_numbers, nadir_boresight, numbers_of_attitudes};
    #[pymodule_export]
    use crate::camera::{
        camera_correct, camera_images, camera_models, camera_partials, camera_patches, camera_rays,
        film_places, film_readings, radial_domain,
    };
    #[pymodule_export]
    use crate::comparator::{ComparatorError, ComparatorSolution, adjust_comparator};
    #[pymodule_export]
    use crate::control_networks::{
        control_header, control_header_message, control_point_messages, control_point_text, control_points,
        control_points_of_text,
    };
    #[pymodule_export]
    use crate::distributions::{
        chi_square, chi_square_quantile, detectable_noncentrality, fisher, fisher_limit,
        level_of_equal_power, log_chi_square, log_fisher, noncentral_chi_square, noncentral_fisher, normal,
        student, student_limit,
    };
    #[pymodule_export]
    use crate::geometry::{
        geocentric_to_geographic, geographic_to_geocentric, measured_feature, nearest_points, project,
        refraction_shift, rotation_angles, rotation_matrix, rotation_vectors, vector_rotations,
    };
    #[pymodule_export]
    use crate::memory::give_back;
    #[pymodule_export]
    use crate::network::block::block_network;
    #[pymodule_export]
    use crate::network::block_network::BlockNetwork;
    #[pymodule_export]
    use crate::network::collection::{CollectionNetwork, collection_images, collection_network};
    #[pymodule_export]
    use crate::network::covariances::BlockCovariances;
    #[pymodule_export]
    use crate::network::first_values::find_first_values;
    #[pymodule_export]
    use crate::network::node::{FormedNode, Node};
    #[pymodule_export]
    use crate::network::snooping::NetworkSnooping;
    #[pymodule_export]
    use crate::network::solution::{BlockSolution, CollectionSolution};
    #[pymodule_export]
    use crate::network::state::BlockState;
    #[pymodule_export]
    use crate::network::suspects::NetworkSuspects;
    #[pymodule_export]
    use crate::network::trial::NetworkTrial;
    #[pymodule_export]
    use crate::network::{BlockError, CollectionError};
    #[pymodule_export]
    use crate::resection::{ResectionError, ResectionSolution, resect};
    #[pymodule_export]
    use crate::similarity::{
        SimilarityError, SimilaritySolution, gauss_crout, orient_model, similarity_partials, transform_points,
    };
    #[pymodule_export]
    use crate::stellar::{
        StellarError, StellarProblem, plate_directions, plate_images, pointing_matrix, pointing_of_matrix,
        refraction, standard_coordinates, star_places, star_similarities,
    };
    #[pymodule_export]
    use crate::text::{TableReader, csv_rows, read_numbers};
    #[pymodule_export]
    use crate::trajectories::{flown, trajectory_span};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::memory::arm()?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("CAMERAS", photocore::geometry::Camera::NAMES.to_vec())?;
        module.add("UNKNOWNS", crate::commons::kinds())
    }
}
