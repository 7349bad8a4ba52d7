//! The checks, one function each.
use crate::facts::shown;
use crate::kinds::{STAND_INS, another, arguments, bytes, graph, it, load, needed, session, stand_in};
use glam::UVec2;
use shibo_engine::eval::{CancelToken, Keys, Silent};
use shibo_engine::session::Failure;
use shibo_node::registry::Registry;
use shibo_node::{KindInfo, ParamType, Role};
use shibo_value::{ChannelSet, Given, Read, Tile, Type, Value, Window};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Checks that a kind, its outputs, its fields and their choices have a text for the manual.
///
/// # Errors
/// Returns the fault in words.
pub fn is_documented(_: &Arc<Registry>, info: &KindInfo) -> Result<(), String> {
    let fields = info.fields.iter().chain(info.params().flat_map(|(_, param)| &param.fields));
    let mut missing: Vec<&str> = fields.filter(|f| f.doc.len() < 8).map(|f| f.name.as_str()).collect();
    let choices = info.params().flat_map(|(_, param)| &param.choices);
    missing.extend(choices.filter(|c| c.doc.is_empty()).map(|c| c.name.as_str()));
    let outputs = info.outputs.iter().filter(|o| o.doc.len() < 8).count();
    if info.doc.len() < 20 || !missing.is_empty() || outputs > 0 || info.outputs.is_empty() {
        return Err(format!("not documented: {missing:?}, {outputs} outputs"));
    }
    Ok(())
}

/// Writing a parameter's default from the manual equals leaving it out: the same node, or the same error.
pub fn defaults_can_be_written(registry: &Arc<Registry>, info: &KindInfo) -> Result<(), String> {
    let made = |field: &str, text: Option<&str>| {
        let (args, nodes) = arguments(registry, info, Some((field, text)))?;
        let node = format!("\"it\": {}({args}),", info.kind);
        let graph = load(registry, &format!("{STAND_INS} {nodes} {node}"), UVec2::splat(16))?;
        Ok::<_, String>(graph.nodes[it(&graph)].node.canonical())
    };
    for (field, param) in info.params() {
        let (written, left_out) = (made(&field.name, Some(&param.written)), made(&field.name, None));
        if written != left_out {
            return Err(format!("`{}: {}` is not the default: {written:?} {left_out:?}", field.name, param.written));
        }
        // Fails only where the manual says so.
        let stands_alone = needed(&info.kind).is_none_or(|(needed, _)| needed != field.name);
        if written.is_err() && stands_alone {
            return Err(format!("`{}: {}` is refused: {written:?}", field.name, param.written));
        }
        if param.required != (written.is_err() && param.ty == ParamType::Path) {
            return Err(format!("whether `{}` must be given is wrong", field.name));
        }
    }
    Ok(())
}

/// Checks that a kind gives the same bytes on 1, 2 and 8 threads and in windows of other sizes.
///
/// # Errors
/// Returns the fault in words.
pub fn is_deterministic(registry: &Arc<Registry>, info: &KindInfo) -> Result<(), String> {
    let graph = graph(registry, info, UVec2::new(300, 280), None)?;
    let reference = bytes(&session(registry, 1), &graph, 300)?;
    for (threads, side) in [(8, 300), (2, 77)] {
        if bytes(&session(registry, threads), &graph, side)? != reference {
            return Err(format!("other bytes on {threads} threads by windows of {side}"));
        }
    }
    Ok(())
}

/// A field evaluated at the centre of a pixel, on a grid of one pixel, agrees with the picture there.
pub fn agrees_at_points(registry: &Arc<Registry>, info: &KindInfo) -> Result<(), String> {
    let size = UVec2::splat(96);
    let graph = graph(registry, info, size, None)?;
    let (session, grid) = (session(registry, 1), graph.canvas.grid(size));
    let (token, node) = (CancelToken::default(), it(&graph));
    for output in 0..graph.nodes[node].outputs.len() {
        let value = session.value(&graph, (node, output), &token, &Silent).map_err(|f| format!("{f:?}"))?;
        // Ids of regions have no values in between.
        for field in value.fields().into_iter().filter(|field| field.ty() != Type::Ids) {
            let points = [(5, 7), (40, 61), (95, 0), (17, 88)];
            let mut wanted = vec![(grid, Window::full(size))];
            let one = Window { x: 0, y: 0, width: 1, height: 1 };
            wanted.extend(points.iter().map(|&(x, y)| (grid.centered_at(grid.center(x, y)), one)));
            let (tiles, _) = session.rasters(&graph, &field, &wanted, &token, &Silent).map_err(|f| format!("{f:?}"))?;
            for (&(x, y), point) in points.iter().zip(&tiles[1..]) {
                let (x, y) = (usize::try_from(x).unwrap(), usize::try_from(y).unwrap());
                for channel in 0..field.channels() {
                    let (a, b) = (tiles[0].row(channel, y)[x], point.row(channel, 0)[0]);
                    if (a - b).abs() > 2e-2 * a.abs().max(1.0) {
                        return Err(format!("output {output} is {a} at ({x}, {y}), but {b} when asked for alone"));
                    }
                }
            }
        }
    }
    Ok(())
}

/// True if a read contains all pixels of a window. One repeat of a field that tiles contains all.
fn covers(read: &Read<'_>, window: &Window) -> bool {
    let (tiling, period) = (read.field.tiling(), read.grid.period.unwrap_or(UVec2::MAX));
    let (x, y) = (tiling.x && read.window.width >= period.x, tiling.y && read.window.height >= period.y);
    let within = Window {
        x: if x { read.window.x } else { window.x },
        width: if x { read.window.width } else { window.width },
        y: if y { read.window.y } else { window.y },
        height: if y { read.window.height } else { window.height },
    };
    read.window.contains(&within)
}

/// The engine's assumptions: a field states the same fields and grids for all windows, and a part of a window needs no
/// more than the whole. Undeclared reads need no test: a field is given nothing else.
pub fn states_what_it_reads(registry: &Arc<Registry>, info: &KindInfo) -> Result<(), String> {
    let size = UVec2::new(300, 280);
    let graph = graph(registry, info, size, None)?;
    let (session, grid, node) = (session(registry, 1), graph.canvas.grid(size), it(&graph));
    let whole = Window { x: -40, y: -7, width: 400, height: 300 };
    let parts = [(-40, -7, 1, 1), (-3, 5, 37, 11), (100, 292, 260, 1), (0, 0, 256, 256)];
    let parts = parts.map(|(x, y, width, height)| Window { x, y, width, height });
    for output in 0..graph.nodes[node].outputs.len() {
        let value = session.value(&graph, (node, output), &CancelToken::default(), &Silent);
        let mut open: Vec<_> = value.map_err(|f| format!("{f:?}"))?.fields().into_iter().map(|f| (f, grid)).collect();
        let mut seen = BTreeSet::new();
        while let Some((field, grid)) = open.pop() {
            if !seen.insert(format!("{:?} {:?}", field.id(), grid.id())) {
                continue;
            }
            let stated = |window| {
                let source = field.source();
                source.inputs(&grid, window).into_iter().chain(source.later(&grid, window)).collect::<Vec<_>>()
            };
            let most = stated(whole);
            for part in parts {
                let reads = stated(part);
                let same = |(a, b): (&Read<'_>, &Read<'_>)| a.field.id() == b.field.id() && a.grid.id() == b.grid.id();
                if reads.len() != most.len() || !reads.iter().zip(&most).all(same) {
                    return Err(format!("output {output} reads other fields for {part:?}"));
                }
                if let Some((read, _)) = reads.iter().zip(&most).find(|(a, b)| !covers(b, &a.window)) {
                    return Err(format!("output {output} reads {:?} for {part:?}, more than for all", read.window));
                }
            }
            open.extend(most.iter().map(|read| (read.field.clone(), read.grid)));
        }
    }
    Ok(())
}

/// A field that declares to overwrite its tiles gives the same result for any previous content.
pub fn overwrites_if_it_says_so(registry: &Arc<Registry>, info: &KindInfo) -> Result<usize, String> {
    let size = UVec2::new(70, 60);
    let graph = graph(registry, info, size, None)?;
    let (grid, window) = (graph.canvas.grid(size), Window { x: 3, y: 1, width: 61, height: 50 });
    let node = it(&graph);
    let (session, token) = (session(registry, 1), CancelToken::default());
    let (mut found, mut seen) = (0, BTreeSet::new());
    for output in 0..graph.nodes[node].outputs.len() {
        let value = session.value(&graph, (node, output), &token, &Silent).map_err(|f| format!("{f:?}"))?;
        let mut open: Vec<_> = shown(&value).into_iter().map(|f| (f, grid, window)).collect();
        while let Some((field, grid, window)) = open.pop() {
            let source = field.source();
            let wanted = source.inputs(&grid, window);
            open.extend(wanted.iter().map(|read| (read.field.clone(), read.grid, read.window)));
            let new = seen.insert(format!("{:?} {:?} {window:?}", field.id(), grid.id()));
            if !field.overwrites() || !new || window.is_empty() {
                continue;
            }
            let mut tiles = Vec::new();
            for read in &wanted {
                let one = [(read.grid, read.window)];
                let made = session.rasters(&graph, read.field, &one, &token, &Silent).map_err(|f| format!("{f:?}"))?;
                tiles.extend(made.0.into_iter().map(Arc::new));
            }
            let filled = |with: f32| {
                let mut tile = Tile::new(grid, window, field.channels());
                tile.data_mut().fill(with);
                source.fill(&Given::new(&tiles, None, &|| false), &mut tile).map_err(|stop| format!("{stop:?}"))?;
                Ok::<_, String>(tile.data().iter().map(|v| v.to_bits()).collect::<Vec<_>>())
            };
            if filled(0.0)? != filled(f32::NAN)? {
                return Err(format!("output {output} reads what was in a tile, or leaves it there"));
            }
            found += 1;
        }
    }
    Ok(found)
}

/// Checks that a kind has another key with another value of each parameter.
///
/// # Errors
/// Returns the fault in words.
pub fn reads_its_parameters(registry: &Arc<Registry>, info: &KindInfo) -> Result<(), String> {
    let key = |change: Option<(&str, &str)>| {
        let graph = graph(registry, info, UVec2::splat(16), change)?;
        let keys = Keys::of(&graph).map_err(|e| format!("{e:?}"))?;
        let last = graph.nodes[it(&graph)].outputs.len() - 1;
        Ok::<_, String>(keys.output(it(&graph), last))
    };
    let plain = key(None)?;
    for field in &info.fields {
        let Role::Param(param) = &field.role else { continue };
        let Some(value) = another(param) else { continue };
        // Contradicting parameters are covered by other tests.
        let Ok(changed) = key(Some((&field.name, &value))) else { continue };
        if changed == plain {
            return Err(format!("`{}: {value}` has the key of the default", field.name));
        }
    }
    Ok(())
}

/// Checks that a kind stops when its run is cancelled.
///
/// # Errors
/// Returns the fault in words.
pub fn can_be_cancelled(registry: &Arc<Registry>, info: &KindInfo) -> Result<(), String> {
    let graph = graph(registry, info, UVec2::splat(64), None)?;
    let token = CancelToken::default();
    token.cancel();
    match session(registry, 1).value(&graph, (it(&graph), 0), &token, &Silent) {
        Err(Failure::Cancelled) => Ok(()),
        other => Err(format!("{other:?} although cancelled")),
    }
}

/// Checks that a kind with its defaults gives finite values at 24², at one pixel and at 1 × 9 pixels.
///
/// # Errors
/// Returns the fault in words.
pub fn is_finite_at_all_sizes(registry: &Arc<Registry>, info: &KindInfo) -> Result<(), String> {
    // One session for all sizes computes results that do not depend on the resolution once.
    let session = session(registry, 1);
    for size in [UVec2::splat(24), UVec2::ONE, UVec2::new(1, 9)] {
        let graph = graph(registry, info, size, None)?;
        bytes(&session, &graph, 64).map_err(|complaint| format!("{complaint} at {size}"))?;
    }
    Ok(())
}

/// Checks that a material has the channels that its kind announces: with required ports only, and with each optional port.
///
/// # Errors
/// Returns the fault in words.
pub fn has_announced_channels(registry: &Arc<Registry>, info: &KindInfo) -> Result<(), String> {
    if info.outputs.iter().all(|output| !output.ty.is_material()) {
        return Ok(());
    }
    let optional = info.ports().filter(|(_, port)| !port.required && !port.list);
    let changes = optional.map(|(field, port)| Some((field.name.as_str(), stand_in(registry, port.ty))));
    for change in std::iter::once(None).chain(changes) {
        // The sources for optional ports are among the stand-ins of every graph.
        let source = change.map(|(field, source)| source.map(|(text, _)| (field, text))).transpose()?;
        let change = source.as_ref().map(|(field, text)| (*field, text.as_str()));
        let graph = graph(registry, info, UVec2::splat(64), change)?;
        let made = session(registry, 1).value(&graph, (it(&graph), 0), &CancelToken::default(), &Silent);
        let Ok(Value::Material(material)) = made else { return Err(format!("it makes no material: {made:?}")) };
        let there: ChannelSet = material.channels().iter().map(|(channel, _)| *channel).collect();
        if graph.nodes[it(&graph)].channels != there {
            return Err(format!("it has the channels {there:?}, not those that it announces: {change:?}"));
        }
    }
    Ok(())
}
