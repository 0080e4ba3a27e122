//! Solves a block by apex-solver: `apex-side INPUT OUTPUT SETTING`, started by `apex_block.py`, which says what the
//! two files of 64-bit floats hold.

use std::error::Error;
use std::time::Instant;
use std::{env, fs};

use apex_solver::JacobianMode;
use apex_solver::apex_camera_models::PinholeCamera;
use apex_solver::apex_manifolds::ManifoldType;
use apex_solver::core::VarKey;
use apex_solver::core::noise::NoiseModel;
use apex_solver::core::problem::Problem;
use apex_solver::factors::BundleAdjustment;
use apex_solver::factors::pose::EuclideanPriorFactor;
use apex_solver::factors::visual::ProjectionFactor;
use apex_solver::linalg::{ExplicitSchurVariant, LinearSolverType};
use apex_solver::optimizer::OptimizationStatus::{
    Converged, CostToleranceReached, GradientToleranceReached, ParameterToleranceReached,
};
use apex_solver::optimizer::gauss_newton::{GaussNewton, GaussNewtonConfig};
use apex_solver::optimizer::levenberg_marquardt::{LevenbergMarquardt, LevenbergMarquardtConfig};
use apex_solver::optimizer::{OptimizeResult, Optimizer};
use nalgebra::{DVector, Matrix2xX};

type Failure = Box<dyn Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = env::args().collect();
    let [_, input, output, setting] = arguments.as_slice() else {
        return Err("wanted: INPUT OUTPUT SETTING".into());
    };
    let mut optimizer = optimizer(setting)?;
    let (mut problem, unknowns) = read(input)?;
    let start = Instant::now();
    let solved = optimizer.optimize(&mut problem);
    write(output, solved, start.elapsed().as_secs_f64(), &unknowns)
}

/// Gauss-Newton (`gn-`) or Levenberg-Marquardt (`lm-`): the normal equations as a whole (`cholesky`), or reduced to
/// the photographs from themselves (`schur`), from the equations of each point (`chunked`), or never formed and solved
/// by iterations (`implicit`), which go on to their tolerance: apex-solver's own end is too far from the minimum.
fn optimizer(setting: &str) -> Result<Box<dyn Optimizer>, Failure> {
    let (method, solver) = setting.split_once('-').ok_or("wanted: METHOD-SOLVER")?;
    let (solver, variant) = match solver {
        "schur" => (LinearSolverType::ExplicitSparseSchur, ExplicitSchurVariant::Sparse),
        "chunked" => (LinearSolverType::ExplicitSparseSchur, ExplicitSchurVariant::Chunked),
        "implicit" => (LinearSolverType::ImplicitSparseSchur, ExplicitSchurVariant::default()),
        "cholesky" => (LinearSolverType::SparseCholesky, ExplicitSchurVariant::default()),
        other => return Err(format!("unknown solver {other}").into()),
    };
    Ok(match method {
        "gn" => Box::new(GaussNewton::with_config(
            GaussNewtonConfig::new()
                .with_linear_solver_type(solver)
                .with_schur_variant(variant)
                .with_schur_cg_q_tolerance(0.0),
        )),
        "lm" => Box::new(LevenbergMarquardt::with_config(
            LevenbergMarquardtConfig::for_bundle_adjustment()
                .with_linear_solver_type(solver)
                .with_schur_variant(variant)
                .with_schur_cg_q_tolerance(0.0),
        )),
        other => return Err(format!("unknown method {other}").into()),
    })
}

/// Read a block as a problem, and the keys of its photographs and points in their order.
fn read(path: &str) -> Result<(Problem, Vec<VarKey>), Failure> {
    let bytes = fs::read(path)?;
    let values: Vec<f64> = bytes.as_chunks().0.iter().map(|&number| f64::from_le_bytes(number)).collect();
    let (counts, rest) = values.split_at(3);
    let [photos, points, images] = [counts[0] as usize, counts[1] as usize, counts[2] as usize];
    let (poses, rest) = rest.split_at(7 * photos);
    let (positions, rest) = rest.split_at(3 * points);
    let (measured, control) = rest.split_at(6 * images);

    let mut problem = Problem::new(JacobianMode::Sparse);
    let add = |problem: &mut Problem, manifold, value: &[f64]| {
        problem.add_variable(manifold, DVector::from_row_slice(value))
    };
    let poses: Vec<VarKey> = poses.chunks(7).map(|pose| add(&mut problem, ManifoldType::SE3, pose)).collect();
    let points: Vec<VarKey> =
        positions.chunks(3).map(|point| add(&mut problem, ManifoldType::RN, point)).collect();
    points.iter().for_each(|&point| problem.mark_for_elimination(point));
    for image in measured.chunks(6) {
        let camera = PinholeCamera::from([image[2], image[3], 0.0, 0.0]);
        let seen = Matrix2xX::from_column_slice(&image[4..]);
        let factor: ProjectionFactor<PinholeCamera, BundleAdjustment> = ProjectionFactor::new(seen, camera);
        problem.add_residual_block(
            &[poses[image[0] as usize], points[image[1] as usize]],
            Box::new(factor),
            None,
        );
    }
    for held in control.chunks(7) {
        let factor = EuclideanPriorFactor::new(DVector::from_row_slice(&held[1..4]));
        let noise = NoiseModel::Diagonal(DVector::from_row_slice(&held[4..]));
        problem.add_residual_block_with_noise(&[points[held[0] as usize]], Box::new(factor), None, noise);
    }
    Ok((problem, [poses, points].concat()))
}

/// Write how the optimization ended, what it cost, and the unknowns.
fn write(path: &str, solved: OptimizeResult, seconds: f64, unknowns: &[VarKey]) -> Result<(), Failure> {
    let solved = solved?;
    let ends = [Converged, CostToleranceReached, GradientToleranceReached, ParameterToleranceReached];
    let converged = f64::from(u8::from(ends.contains(&solved.status)));
    let mut values = vec![
        converged,
        solved.iterations as f64,
        solved.initial_cost,
        solved.final_cost,
        seconds,
        peak_bytes()?,
    ];
    for &key in unknowns {
        values.extend_from_slice(solved.parameters[key].as_param_slice());
    }
    Ok(fs::write(path, values.into_iter().flat_map(f64::to_le_bytes).collect::<Vec<u8>>())?)
}

/// The highest resident memory of this process.
fn peak_bytes() -> Result<f64, Failure> {
    let status = fs::read_to_string("/proc/self/status")?;
    let kibibytes = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next());
    Ok(1024.0 * kibibytes.ok_or("/proc/self/status tells no VmHWM")?.parse::<f64>()?)
}
