//! The design of a run on the mesh of another case.

use std::path::{Path, PathBuf};

use slipstick_case::construct::build_mesh;
use slipstick_case::file::parse_case_with;
use slipstick_design::{ElementValues, Places};
use slipstick_mesh::{Body, Mesh};

use super::densities::{DESIGN_VARIABLE, read_column, table_of};
use super::{RunError, mesh_files, read_density};

/// The design of an earlier run, or of a table, on a mesh.
#[derive(Debug, Clone)]
pub struct StoredDesign {
    /// The densities.
    pub density: ElementValues,
    /// The design variables, at all elements; `None` if the table lists none, because they are the
    /// densities.
    pub variables: Option<ElementValues>,
    /// Number of elements of the run's mesh, if the values were mapped from another mesh.
    pub mapped_from: Option<usize>,
}

/// Loads a design: `results` is the directory of a run, or a table itself.
///
/// A table must list the elements of this mesh. The design of a run with another mesh is mapped, by
/// reference position, from the body of the same name: an element takes the mean over its corners
/// of the value half-way between its centroid and the corner, which is that of the run's element
/// with the nearest centroid. On regular grids, the map is exact where elements are divided, or
/// combined in pairs. Bodies that are not `designed` may be missing in the run; they are solid.
///
/// # Errors
/// As [`read_density`]; [`RunError::NoRun`] for a directory without `design.csv`;
/// [`RunError::Densities`] if a designed body is missing in the run, or lies elsewhere.
pub fn load_design(results: &Path, mesh: &Mesh, designed: &[String]) -> Result<StoredDesign, RunError> {
    let table = table_of(results)?;
    let of_run = results.is_dir().then(|| mesh_of_run(results)).flatten();
    let other = of_run.filter(|from| from.elements != mesh.elements || !same_bodies(&from.bodies, &mesh.bodies));
    let on = other.as_ref().unwrap_or(mesh);
    let (density, variables) = (read_density(&table, on)?, read_column(&table, on, DESIGN_VARIABLE)?);
    let Some(from) = other else { return Ok(StoredDesign { density, variables, mapped_from: None }) };
    let transfer = Transfer::new(&table, &from, mesh, designed)?;
    Ok(StoredDesign {
        density: transfer.apply(&density),
        variables: variables.map(|values| transfer.apply(&values)),
        mapped_from: Some(from.elements.len()),
    })
}

/// The mesh of a run, from its own files; `None` if they cannot be read or do not make a mesh.
fn mesh_of_run(directory: &Path) -> Option<Mesh> {
    let path = directory.join("case.toml");
    let text = std::fs::read_to_string(&path).ok()?;
    let resolved = parse_case_with(&text, &path.display().to_string(), &mesh_files(&path)).ok()?;
    build_mesh(&resolved.case).ok()
}

fn same_bodies(a: &[Body], b: &[Body]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.name == b.name && a.elements == b.elements)
}

/// For each element of a mesh, the elements of another mesh whose mean it takes, one per corner.
struct Transfer {
    sources: Vec<Vec<usize>>,
}

impl Transfer {
    /// Elements of bodies that the run does not have get no sources if the bodies are not designed.
    fn new(table: &Path, from: &Mesh, to: &Mesh, designed: &[String]) -> Result<Self, RunError> {
        let mut sources = vec![Vec::new(); to.elements.len()];
        let (centroids, found_at) = (to.centroids(), from.centroids());
        for body in to.bodies.iter().filter(|body| !body.elements.is_empty()) {
            let source = from.bodies.iter().find(|source| source.name == body.name && !source.elements.is_empty());
            let Some(source) = source else {
                match designed.contains(&body.name) {
                    true => return Err(no_body(table, &body.name, from)),
                    false => continue,
                }
            };
            let places = Places::new(found_at[source.elements.clone()].to_vec());
            let corners = body.elements.clone().map(|e| to.elements[e].corners().len());
            let samples = body.elements.clone().flat_map(|e| samples(to, e, centroids[e])).collect::<Vec<_>>();
            let mut nearest = places.nearest(&samples).into_iter();
            for (e, corners) in body.elements.clone().zip(corners) {
                for (at, distance) in nearest.by_ref().take(corners) {
                    let at = source.elements.start + at;
                    let reach = radius(from, at, found_at[at]) + radius(to, e, centroids[e]);
                    if distance > reach {
                        return Err(elsewhere(table, &body.name, e, centroids[e], distance));
                    }
                    sources[e].push(at);
                }
            }
        }
        Ok(Self { sources })
    }

    fn apply(&self, values: &ElementValues) -> ElementValues {
        let mean = |from: &Vec<usize>| match from.len() {
            0 => 1.0,
            count => from.iter().map(|&e| values[e]).sum::<f64>() / count as f64,
        };
        self.sources.iter().map(mean).collect()
    }
}

/// The points half-way between the centroid and each corner. \[L\]
fn samples(mesh: &Mesh, element: usize, centroid: [f64; 3]) -> Vec<[f64; 3]> {
    let corners = mesh.elements[element].corners().iter();
    let half_way = |&node: &u32| std::array::from_fn(|c| 0.5 * (centroid[c] + mesh.nodes[node as usize][c]));
    corners.map(half_way).collect()
}

/// Distance of the farthest corner from the centroid. \[L\]
fn radius(mesh: &Mesh, element: usize, centroid: [f64; 3]) -> f64 {
    let squared = |&node: &u32| (0..3).map(|c| (mesh.nodes[node as usize][c] - centroid[c]).powi(2)).sum::<f64>();
    mesh.elements[element].corners().iter().map(squared).fold(0.0, f64::max).sqrt()
}

fn wrong(table: &Path, reason: String, cure: String) -> RunError {
    RunError::Densities { path: PathBuf::from(table), line: None, reason, cure }
}

fn no_body(table: &Path, name: &str, from: &Mesh) -> RunError {
    let names: Vec<&str> = from.bodies.iter().map(|body| body.name.as_str()).collect();
    wrong(
        table,
        format!("the run has a different mesh and no body `{name}`"),
        format!("give bodies of both cases the same names; those of the run are: {}", names.join(", ")),
    )
}

fn elsewhere(table: &Path, name: &str, element: usize, [x, y, z]: [f64; 3], distance: f64) -> RunError {
    wrong(
        table,
        format!(
            "the run has a different mesh, and its body `{name}` does not reach element {element} of the case at \
             ({x:.4}, {y:.4}, {z:.4}): its nearest element is {distance:.3} away"
        ),
        "use a run in which the body has the same position, size and length unit".into(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipstick_mesh::{BoxShape, box_mesh};

    fn bar(elements: [usize; 3], length: f64) -> Mesh {
        box_mesh("bar", &BoxShape { min: [0.0; 3], max: [length, 2.0, 1.0], elements, grading: [1.0; 3] })
            .expect("a mesh")
    }

    fn transferred(from: &Mesh, to: &Mesh, values: &ElementValues) -> ElementValues {
        Transfer::new(Path::new("design.csv"), from, to, &["bar".into()]).expect("meshes of one body").apply(values)
    }

    fn numbered(mesh: &Mesh) -> ElementValues {
        (0..mesh.elements.len()).map(|e| (e as f64 + 1.0).sqrt() / 10.0).collect()
    }

    /// By definition: the parts of an element have its value, and their mean is that value again.
    #[test]
    fn divided_and_combined_elements_keep_the_value() {
        let (coarse, fine) = (bar([4, 2, 1], 4.0), bar([8, 4, 2], 4.0));
        let values = numbered(&coarse);
        let divided = transferred(&coarse, &fine, &values);
        for (e, value) in divided.iter().enumerate() {
            let at = fine.centroid(e);
            let parent = (0..coarse.elements.len()).find(|&parent| {
                let centre = coarse.centroid(parent);
                (0..3).all(|c| (at[c] - centre[c]).abs() < 0.5)
            });
            let expected = values[parent.expect("every part lies in an element")];
            assert!((value - expected).abs() < 1e-15, "{value} instead of {expected}");
        }
        let combined = transferred(&fine, &coarse, &divided);
        combined.iter().zip(values.iter()).for_each(|(found, value)| assert!((found - value).abs() < 1e-15));
    }

    /// A field that is linear in x, sampled at centroids of unequal meshes, comes back within half
    /// an element's slope, and the mean over the body exactly, because the field is antisymmetric
    /// about the middle.
    #[test]
    fn unequal_meshes_keep_a_linear_field() {
        let (from, to) = (bar([10, 3, 2], 4.0), bar([7, 4, 3], 4.0));
        let values: ElementValues = from.centroids().iter().map(|x| x[0] / 4.0).collect();
        let found = transferred(&from, &to, &values);
        for (value, at) in found.iter().zip(to.centroids()) {
            assert!((value - at[0] / 4.0).abs() <= 0.05, "{value} at {at:?}");
        }
        let mean = found.iter().sum::<f64>() / found.len() as f64;
        assert!((mean - 0.5).abs() < 1e-12, "{mean}");
    }

    #[test]
    fn a_body_that_is_missing_or_elsewhere_is_an_error() {
        let mesh = bar([4, 2, 1], 4.0);
        let mut renamed = mesh.clone();
        renamed.bodies[0].name = "rod".into();
        let fails = |from: &Mesh, to: &Mesh| match Transfer::new(Path::new("design.csv"), from, to, &["bar".into()]) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("the meshes do not match"),
        };
        let message = fails(&renamed, &mesh);
        assert!(message.contains("no body `bar`"), "{message}");
        let message = fails(&mesh, &bar([8, 2, 1], 8.0));
        assert!(message.contains("does not reach element"), "{message}");
        assert!(
            Transfer::new(Path::new("design.csv"), &bar([8, 2, 1], 8.0), &mesh, &[]).is_ok(),
            "a part of a body is enough"
        );
    }
}
