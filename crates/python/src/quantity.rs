//! Quantities that users define in Python.

use std::cell::RefCell;

use numpy::{IntoPyArray, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use slipstick::design::quantity::{
    ContactDerivative, ContactNode, Dimension, ElementData, Quantity, Reads, StateDerivative, StateView,
};

use crate::arrays;

thread_local! {
    /// The first exception of a quantity since the last call of [`take_raised`]. Quantities are
    /// evaluated in the thread of the call.
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

/// The exception that a quantity has raised in this thread; its value was then not a number.
pub fn take_raised() -> Option<PyErr> {
    RAISED.take()
}

/// A quantity defined in Python. `adapter` checks shapes and types of the results.
pub struct Defined {
    pub name: String,
    pub dimension: Dimension,
    pub reads: Reads,
    pub accumulates: bool,
    pub adapter: Py<PyAny>,
}

/// A quantity as passed from Python: adapter, name, powers of force and length, the names of what it reads,
/// and whether it accumulates.
pub type Definition = (Py<PyAny>, String, (i32, i32), Vec<String>, bool);

/// The quantity of a definition.
pub fn defined((adapter, name, (force, length), names, accumulates): Definition) -> Defined {
    let mut reads = Reads::default();
    for name in names {
        let read = match name.as_str() {
            "reaction" => &mut reads.reaction,
            "contact" => &mut reads.contact,
            "previous" => &mut reads.previous,
            // the package passes no other name
            name => match reads.elements.named(name) {
                Some(read) => read,
                None => continue,
            },
        };
        *read = true;
    }
    Defined { name, dimension: Dimension::of(force, length), reads, accumulates, adapter }
}

impl Defined {
    fn call<T>(&self, call: impl FnOnce(Python<'_>, &Bound<'_, PyAny>) -> PyResult<T>) -> Option<T> {
        Python::attach(|py| match call(py, self.adapter.bind(py)) {
            Ok(value) => Some(value),
            Err(error) => {
                RAISED.with_borrow_mut(|raised| drop(raised.get_or_insert(error).clone_ref(py)));
                None
            }
        })
    }
}

impl Quantity for Defined {
    fn name(&self) -> &str {
        &self.name
    }

    fn dimension(&self) -> Dimension {
        self.dimension
    }

    fn reads(&self) -> Reads {
        self.reads
    }

    fn accumulates(&self) -> bool {
        self.accumulates
    }

    fn value(&self, view: &StateView) -> f64 {
        let value = self.call(|py, adapter| adapter.call_method1("value", (state(py, view)?,))?.extract());
        value.unwrap_or(f64::NAN)
    }

    fn pull_back(&self, view: &StateView, weight: f64, to: &mut StateDerivative) {
        self.call(|py, adapter| {
            let found = adapter.call_method1("derivative", (state(py, view)?,))?;
            for (key, entries) in found.cast::<PyDict>()?.iter() {
                let entries: PyReadonlyArrayDyn<'_, f64> = entries.extract()?;
                add(key.extract::<&str>()?, entries.as_slice()?, weight, to);
            }
            Ok(())
        });
    }
}

/// The data of a state that a quantity reads, as arrays.
fn state<'py>(py: Python<'py>, view: &StateView) -> PyResult<Bound<'py, PyDict>> {
    let state = PyDict::new(py);
    state.set_item("step", view.step)?;
    state.set_item("steps", view.steps)?;
    state.set_item("time", view.time)?;
    for (name, entries, columns) in [
        ("displacement", view.displacement, 3),
        ("internal_force", view.internal_force, 3),
        ("external_force", view.external_force, 3),
        ("reaction", view.reaction, 3),
    ] {
        state.set_item(name, arrays::matrix(py, entries.to_vec(), columns))?;
    }
    state.set_item("density", view.density.to_vec().into_pyarray(py))?;
    for (list, entries) in ElementData::<f64>::LISTS.into_iter().zip(view.elements.each()) {
        match list.width {
            1 => state.set_item(list.name, entries.to_vec().into_pyarray(py))?,
            width => state.set_item(list.name, arrays::matrix(py, entries.to_vec(), width))?,
        }
    }
    let all = |of: fn(&ContactNode) -> &[f64]| view.contact.iter().flat_map(|at| of(at).to_vec()).collect::<Vec<f64>>();
    let contact = PyDict::new(py);
    contact.set_item("node", arrays::numbers(py, view.contact.iter().map(|at| at.node)))?;
    contact.set_item("pair", arrays::numbers(py, view.contact.iter().map(|at| at.pair)))?;
    contact.set_item("status", view.contact.iter().map(|at| at.status.code()).collect::<Vec<u8>>().into_pyarray(py))?;
    contact.set_item("multiplier", arrays::matrix(py, all(|at| &at.multiplier), 3))?;
    contact.set_item("vector", arrays::matrix(py, all(|at| &at.vector), 3))?;
    contact.set_item("gap", all(|at| std::slice::from_ref(&at.gap)).into_pyarray(py))?;
    contact.set_item("slip", arrays::matrix(py, all(|at| &at.slip), 2))?;
    contact.set_item("area", all(|at| std::slice::from_ref(&at.area)).into_pyarray(py))?;
    contact.set_item("reference_area", all(|at| std::slice::from_ref(&at.reference_area)).into_pyarray(py))?;
    state.set_item("contact", contact)?;
    let previous = PyDict::new(py);
    for (name, entries) in [
        ("displacement", view.previous.displacement),
        ("external_force", view.previous.external_force),
        ("reaction", view.previous.reaction),
        ("multiplier", view.previous.multiplier.as_flattened()),
    ] {
        previous.set_item(name, arrays::matrix(py, entries.to_vec(), 3))?;
    }
    state.set_item("previous", previous)?;
    Ok(state)
}

/// Adds weighted partial derivatives with respect to a field.
fn add(field: &str, entries: &[f64], weight: f64, to: &mut StateDerivative) {
    if let Some(whole) = to.elements.named(field) {
        return whole.iter_mut().zip(entries).for_each(|(to, entry)| *to += weight * entry);
    }
    let whole = match field {
        "displacement" => &mut to.displacement,
        "internal_force" => &mut to.internal_force,
        "external_force" => &mut to.external_force,
        "reaction" => &mut to.reaction,
        "density" => &mut to.density,
        "previous.displacement" => &mut to.previous.displacement,
        "previous.external_force" => &mut to.previous.external_force,
        "previous.reaction" => &mut to.previous.reaction,
        "previous.multiplier" => {
            let all = to.previous.multiplier.as_flattened_mut();
            return all.iter_mut().zip(entries).for_each(|(to, entry)| *to += weight * entry);
        }
        _ => {
            let of: fn(&mut ContactDerivative) -> &mut [f64] = match field {
                "contact.multiplier" => |at| &mut at.multiplier,
                "contact.vector" => |at| &mut at.vector,
                "contact.gap" => |at| std::slice::from_mut(&mut at.gap),
                "contact.slip" => |at| &mut at.slip,
                // the adapter passes no other field
                _ => |at| std::slice::from_mut(&mut at.area),
            };
            let all = to.contact.iter_mut().flat_map(of);
            return all.zip(entries).for_each(|(to, entry)| *to += weight * entry);
        }
    };
    whole.iter_mut().zip(entries).for_each(|(to, entry)| *to += weight * entry);
}
