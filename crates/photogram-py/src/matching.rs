//! Matching of points and stars; the documentation is in `_photocore.pyi`.

use nalgebra::Complex;
use numpy::PyArray1;
use photocore::geometry::nearest;
use photogram_programs::stellar::{Agreement, Similarity, best_voted, hypotheses};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Array, Indices, Matrix, check_lengths, group_rows, rows, table};

#[pyfunction]
#[pyo3(signature = (points, others, limit, but = None))]
pub fn nearest_points<'py>(
    py: Python<'py>,
    points: Array<'py>,
    others: Array<'py>,
    limit: f64,
    but: Option<Vec<i64>>,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let (points, others) = (rows("points", &points)?, rows("others", &others)?);
    if let Some(but) = &but {
        check_lengths(("points", points.len()), &[("but", but.len())])?;
    }
    let but: Option<Vec<_>> = but.map(|but| but.into_iter().map(|k| usize::try_from(k).ok()).collect());
    let found = py.detach(|| nearest(&points, &others, limit, but.as_deref()));
    Ok(PyArray1::from_vec(py, found.into_iter().map(|k| k.map_or(-1, |k| k as i64)).collect()))
}

#[pyfunction]
#[pyo3(signature = (images, stars, candidates, *, makers, tolerance, stretch, least, axis, limit, wanted))]
pub fn star_similarities<'py>(
    py: Python<'py>,
    images: Array<'py>,
    stars: Array<'py>,
    candidates: Indices<'py>,
    makers: usize,
    tolerance: f64,
    stretch: f64,
    least: f64,
    axis: Option<([f64; 2], f64)>,
    limit: f64,
    wanted: usize,
) -> PyResult<(usize, Matrix<'py>)> {
    let plane = |rows: Vec<[f64; 2]>| rows.into_iter().map(|[x, y]| Complex::new(x, y)).collect::<Vec<_>>();
    let (images, stars) = (plane(rows("images", &images)?), plane(rows("stars", &stars)?));
    let pairs: Vec<(usize, usize)> =
        group_rows("candidates", &candidates)?.into_iter().map(|[image, star]| (image, star)).collect();
    if pairs.iter().any(|&(image, star)| image >= makers.min(images.len()) || star >= stars.len()) {
        return Err(PyValueError::new_err("a candidate is no image and star"));
    }
    let axis = axis.map(|([x, y], radius)| (Complex::new(x, y), radius));
    let rule = Agreement { tolerance, stretch, least, axis };
    let (count, best) = py.detach(|| {
        let all = hypotheses(&images[..makers.min(images.len())], &stars, &pairs, &rule);
        (all.len(), best_voted(&all, &images, &stars, makers, limit, wanted))
    });
    let row = |each: &Similarity| [each.factor.re, each.factor.im, each.shift.re, each.shift.im];
    Ok((count, table(py, best.iter().map(row).collect())?))
}
