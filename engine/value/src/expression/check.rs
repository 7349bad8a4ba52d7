//! Checks functions of the user.
use super::apply::Maker;
use super::builder::Builder;
use super::compile::{recursion, run};
use super::term::{Sort, Term};
use super::tree::{Callee, NodeKind};
use super::unit::{Unit, load_function};
use super::{Fault, Names, UserFunction};

/// All faults of a function that can be found without a call: syntax, unknown names and functions, numbers of arguments,
/// recursion, and components that never go together. Faults of the functions that it calls are not among them.
pub fn check_function(function: &UserFunction, names: &mut dyn Names) -> Vec<Fault> {
    let mut loaded = load_function(function, names);
    let whole = loaded.faults.is_empty() && !loaded.broken;
    loaded.faults.retain(|fault| fault.function.as_ref() == Some(&function.name));
    let mut faults = loaded.faults;
    let units = loaded.units;
    faults.extend(recursions(&units, &function.name));
    if whole && faults.is_empty() {
        let mut builder = Builder::default();
        let mut any = |plane| Term { parts: vec![builder.plane(plane)], sort: Sort::Any, range: 0..0 };
        let params = (0..function.params.len()).map(&mut any).collect();
        let maker = Maker { text: "", builder, names, seed: Some(0), outline: true };
        let fault = run(&units, params, maker).err();
        faults.extend(fault.filter(|fault| fault.function.as_ref() == Some(&function.name)));
    }
    faults
}

/// The calls in the first unit that lead back to it.
fn recursions(units: &[Unit], name: &str) -> Vec<Fault> {
    let calls = |unit: &Unit| {
        let called = unit.tree.nodes.iter().filter_map(|node| match node.kind {
            NodeKind::Call { callee: Callee::User { unit, .. }, name_end, .. } => {
                Some((unit, node.range.start..name_end))
            }
            _ => None,
        });
        called.collect::<Vec<_>>()
    };
    // The units that lead to the first one, found backwards.
    let mut callers = vec![Vec::new(); units.len()];
    for (caller, unit) in units.iter().enumerate() {
        calls(unit)
            .iter()
            .filter(|(called, _)| *called < units.len())
            .for_each(|(called, _)| callers[*called].push(caller));
    }
    let mut leads = vec![false; units.len()];
    let mut open = vec![0];
    while let Some(unit) = open.pop() {
        if let Some(seen) = leads.get_mut(unit).filter(|seen| !**seen) {
            *seen = true;
            open.extend(&callers[unit]);
        }
    }
    let Some(first) = units.first() else { return Vec::new() };
    let wrong = calls(first).into_iter().filter(|(called, _)| leads.get(*called) == Some(&true));
    let fault = |(_, range)| Fault { function: Some(name.to_owned()), ..recursion(range, name) };
    wrong.map(fault).collect()
}
