//! Tests of films.
use super::super::bundle::ExportContext;
use super::super::heights::HeightsWriter;
use super::super::heights::tests::{map, problem};
use super::*;
use crate::Compression;
use crate::value::{Field, Type};
use std::io::{Read, Seek};
use std::sync::atomic::{AtomicU32, Ordering};

fn maker() -> FilmMaker {
    FilmMaker {
        stem: "a".to_owned(),
        films: 3,
        given: None,
        choice: Choice::Best,
        binary: false,
        datum: None,
        margin: 0.0,
        marks: true,
        tiles: UVec2::ONE,
        mirror: false,
        format: Some(Format::Tiff),
    }
}

/// Heights from 0 down to -1.
fn heights() -> Vec<f32> {
    (0..600_u32).map(|k| -((k * k * 31 % 601) as f32 / 601.0)).collect()
}

/// Depths that films etch, and those of the heights.
fn etched(maker: &FilmMaker, map: &HeightMap) -> (Vec<f64>, Plates) {
    let plates = maker.plates(map).unwrap();
    let mut depths = vec![0.0; map.values.len()];
    for number in 1..=maker.films {
        let mut open = vec![0; map.values.len()];
        maker.open(&plates, number, &map.values, &mut open);
        for (depth, open) in depths.iter_mut().zip(open) {
            *depth += f64::from(open) * plates.steps[number - 1];
        }
    }
    (depths, plates)
}

#[test]
fn films_add_up_to_the_nearest_depth() {
    let map = map(20, &heights());
    let given = FilmMaker { films: 4, given: Some(vec![0.1, 0.35, 0.4, 0.9]), ..maker() };
    let even = FilmMaker { choice: Choice::Even, films: 5, ..maker() };
    let binary = FilmMaker { binary: true, ..maker() };
    for maker in [maker(), given, even, binary] {
        let (etched, plates) = etched(&maker, &map);
        assert_eq!(plates.levels.len(), if maker.binary { 8 } else { maker.films + 1 });
        for (etched, height) in etched.iter().zip(&map.values) {
            let depth = plates.datum - f64::from(*height);
            let nearest = plates.levels.iter().map(|level| (level - depth).abs()).fold(f64::INFINITY, f64::min);
            assert!(((etched - depth).abs() - nearest).abs() < 1e-6, "{depth}: {etched}");
        }
    }
}

#[test]
fn refuses_heights_that_films_cannot_etch() {
    let folder = tempfile::tempdir().unwrap();
    let made = |maker: FilmMaker, values: &[f32]| problem(maker.make(&map(2, values), folder.path(), &|| false));
    let flat = made(maker(), &[1.0; 4]);
    assert!(flat.code == Code::BadValue && flat.message.contains("nothing to etch"), "{flat}");
    let few = made(maker(), &[0.0, -1.0, -2.0, 0.0]);
    assert_eq!(few.help.as_deref(), Some("write `films: 2`"));
    let deep = made(FilmMaker { given: Some(vec![0.1, 0.2]), films: 2, ..maker() }, &[0.0, -0.1, -0.5, -0.2]);
    assert_eq!(deep.code, Code::TooDeep);
    assert!(deep.message.contains("0.5 mm deep at (0.50, 1.50) mm"), "{deep}");
    let tiles = made(FilmMaker { tiles: UVec2::new(1, 2), ..maker() }, &[0.0, -0.1, -0.5, -0.2]);
    assert!(tiles.code == Code::DoesNotTile && tiles.message.contains("down"), "{tiles}");
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
}

#[test]
fn mirrored_films_read_backwards_and_repeat() {
    let folder = tempfile::tempdir().unwrap();
    let values = heights();
    let place =
        ExportContext { stem: "a".to_owned(), size_mm: DVec2::new(20.0, 30.0), wraps: [true; 2], metadata: Vec::new() };
    let written = |maker: FilmMaker| {
        let field = Field::constant(Type::Gray, &[0.0]);
        let heights = Heights { field: Some(field), place: place.clone(), maker: Arc::new(maker) };
        let mut writer = HeightsWriter::new(&heights, folder.path(), UVec2::new(20, 30), Compression::Fast);
        writer.add(&[&values]).unwrap();
        writer.finish().unwrap();
        crate::read(&folder.path().join("a_2.tif"), &crate::ReadLimits::default()).unwrap()
    };
    let plain = written(FilmMaker { margin: 4.0, ..maker() });
    let wide = written(FilmMaker { margin: 4.0, tiles: UVec2::new(2, 3), mirror: true, ..maker() });
    assert_eq!((plain.width, plain.height), (28, 38));
    assert_eq!((wide.width, wide.height), (48, 98));
    for y in 0..30 {
        for x in 0..20 {
            let at = |x: usize, y: usize| plain.planes[(y + 4) * 28 + x + 4];
            let there = |x: usize, y: usize| wide.planes[(y + 4) * 48 + x + 4];
            assert_eq!(at(x, y), there(19 - x, y));
            assert_eq!(at(x, y), there(39 - x, y + 60));
        }
    }
    let table: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("a_films.json")).unwrap()).unwrap();
    assert_eq!(table["films"].as_array().unwrap().len(), 3);
    assert_eq!(table["depths_mm"].as_array().unwrap().len(), 4);
}

/// A stop is heard within a film of any format, not only between films.
#[test]
fn work_stops_within_a_film() {
    let folder = tempfile::tempdir().unwrap();
    let map = HeightMap { wraps: [true; 2], ..map(20, &heights()) };
    for format in [Some(Format::Tiff), Some(Format::Png), None] {
        let asked = AtomicU32::new(0);
        let stop = || asked.fetch_add(1, Ordering::Relaxed) >= 1;
        let tiles = if format.is_some() { UVec2::new(1000, 1000) } else { UVec2::ONE };
        let error = FilmMaker { films: 1, format, tiles, ..maker() }.make(&map, folder.path(), &stop).err().unwrap();
        assert!(matches!(error, WriteError::Io { source, .. } if source.kind() == io::ErrorKind::Interrupted));
        assert_eq!(asked.into_inner(), 2, "{format:?}");
    }
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
}

/// The text of the second film as a drawing.
fn drawn(maker: FilmMaker) -> String {
    let folder = tempfile::tempdir().unwrap();
    let map = HeightMap { wraps: [true; 2], ..map(20, &heights()) };
    let parts = FilmMaker { format: None, ..maker }.make(&map, folder.path(), &|| false).unwrap();
    let Some(Part::File(mut file)) = parts.into_iter().nth(1) else { panic!("no film") };
    let mut text = String::new();
    file.rewind().unwrap();
    file.read_to_string(&mut text).unwrap();
    text
}

#[test]
fn tiles_of_a_drawing_share_its_areas() {
    let data = |text: &str| text.split(" d=\"").nth(1).unwrap().split('"').next().unwrap().to_owned();
    let (one, many) = (drawn(maker()), drawn(FilmMaker { tiles: UVec2::new(30, 20), mirror: true, ..maker() }));
    assert_eq!(data(&one), data(&many));
    assert!(data(&one).len() > 1000 && !one.contains("<use"), "{one}");
    assert_eq!((many.matches(" d=\"").count(), many.matches("<use xlink:href=\"#tile\"").count()), (1, 600));
    assert!(many.contains("x=\"580\" y=\"570\"/>") && many.contains("translate(600 0) scale(-1 1)"), "{many}");
    assert!(many.len() < one.len() + 600 * 60);
}
