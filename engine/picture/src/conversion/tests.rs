use super::*;
use crate::icc;
use crate::{FileFormat, Header, HeaderStatements, color::linear_sample, default_names};
use moxcms::{ColorProfile, ProfileText, ToneReprCurve};

fn picture(channels: u8, source: SampleKind, planes: Vec<f32>) -> Picture {
    let width = u32::try_from(planes.len() / usize::from(channels)).unwrap();
    let (names, has_alpha) = (default_names(channels), channels.is_multiple_of(2));
    Picture { width, height: 1, channels, planes, source, names, has_alpha }
}

fn header(channels: u8, kind: SampleKind) -> Header {
    let (names, has_alpha, told) = (default_names(channels), channels.is_multiple_of(2), HeaderStatements::default());
    let (format, width, height, icc, associated) = (FileFormat::Png, 1, 1, None, false);
    Header { format, width, height, channels, kind, names, has_alpha, icc, associated, told }
}

fn with_profile(channels: u8, profile: &ColorProfile) -> Header {
    Header { icc: Some(profile.encode().unwrap()), ..header(channels, SampleKind::U8) }
}

/// The colour 200, 100, 50 of a picture with this header, as sRGB codes. No assumption may be needed.
#[track_caller]
fn seen(header: &Header) -> [f32; 3] {
    let (conversion, unused) = Conversion::of_file(header);
    assert_eq!(unused, Vec::<String>::new());
    let mut picture = picture(3, SampleKind::U8, [200.0, 100.0, 50.0].map(|code| code / 255.0).to_vec());
    conversion.apply(&mut picture);
    let encoder = crate::SrgbEncoder::new();
    [0, 1, 2].map(|channel| f32::from(encoder.code(picture.planes[channel])))
}

#[test]
fn converts_integers_by_table() {
    let samples: Vec<f32> = (0..=255_u8).map(|code| f32::from(code) / 255.0).collect();
    let mut picture = picture(4, SampleKind::U8, samples.clone());
    let (conversion, unused) = Conversion::of_file(&header(4, SampleKind::U8));
    assert_eq!((&conversion, unused.len()), (&ColorSpace::Srgb.into(), 0));
    conversion.apply(&mut picture);
    let expected: Vec<f32> = samples[..192].iter().map(|sample| linear_sample(*sample)).collect();
    assert_eq!(picture.planes[..192], expected);
    assert_eq!(picture.planes[192..], samples[192..], "opacity is not colour");
}

#[test]
fn takes_colours_of_integers_as_srgb() {
    use SampleKind::{F16, F32, U8, U16, U32};
    let space = |channels: u8, kind: SampleKind| Conversion::of_file(&header(channels, kind)).0;
    for (channels, kind) in [(3, U8), (4, U8), (3, U16), (4, U16)] {
        assert_eq!(space(channels, kind), ColorSpace::Srgb.into(), "{channels} {kind:?}");
    }
    for (channels, kind) in [(1, U8), (2, U8), (1, U16), (2, U16), (3, U32), (3, F16), (4, F32), (1, F32)] {
        assert_eq!(space(channels, kind), ColorSpace::Raw.into(), "{channels} {kind:?}");
    }
}

#[test]
fn converts_by_profiles_of_a_matrix_and_curves() {
    // Computed with Little CMS, relative colorimetric.
    assert_eq!(seen(&with_profile(3, &ColorProfile::new_adobe_rgb())), [227.0, 100.0, 42.0]);
    assert_eq!(seen(&with_profile(3, &ColorProfile::new_srgb())), [200.0, 100.0, 50.0]);
    let p3 = seen(&with_profile(3, &ColorProfile::new_display_p3()));
    let named = HeaderStatements { cicp: Some([12, 13, 0, 1]), ..HeaderStatements::default() };
    assert_eq!(p3, seen(&Header { told: named, ..header(3, SampleKind::U8) }));
    assert_eq!(p3, [215.0, 93.0, 31.0]);
}

#[test]
fn has_the_bits_of_srgb_for_an_srgb_profile() {
    let curve = |curve: &mut Option<ToneReprCurve>| {
        // Many profiles have a table instead of the curve.
        #[expect(clippy::cast_possible_truncation, reason = "codes of 16 bits")]
        let code = |k: u16| (linear_sample(f32::from(k) / 1023.0) * 65535.0).round() as u16;
        *curve = Some(ToneReprCurve::Lut((0..1024).map(code).collect()));
    };
    let mut profile = ColorProfile::new_srgb();
    assert_eq!(Conversion::of_file(&with_profile(3, &profile)).0, ColorSpace::Srgb.into());
    [&mut profile.red_trc, &mut profile.green_trc, &mut profile.blue_trc].into_iter().for_each(curve);
    assert_eq!(Conversion::of_file(&with_profile(3, &profile)).0, ColorSpace::Srgb.into());
}

#[test]
fn converts_grey_by_a_grey_profile_only() {
    let grey = with_profile(1, &ColorProfile::new_gray_with_gamma(2.2));
    let (conversion, unused) = Conversion::of_file(&grey);
    let mut one = picture(1, SampleKind::U8, vec![0.5]);
    conversion.apply(&mut one);
    assert!((one.planes[0] - 0.2176).abs() < 1e-3 && unused.is_empty(), "{one:?} {unused:?}");
    let (conversion, unused) = Conversion::of_file(&with_profile(1, &ColorProfile::new_adobe_rgb()));
    assert_eq!(conversion, ColorSpace::Raw.into());
    let expected = "its ICC profile is one of RGB, and the picture is grey; its samples are taken as they are";
    assert_eq!(unused, [expected]);
}

#[test]
fn tells_profiles_that_are_not_used() {
    let adobe = ColorProfile::new_adobe_rgb().encode().unwrap();
    let mut tables = ColorProfile::new_adobe_rgb();
    tables.red_trc = None;
    let mut black = ColorProfile::new_adobe_rgb();
    black.red_colorant = black.green_colorant;
    let mut flat = ColorProfile::new_adobe_rgb();
    flat.blue_trc = Some(ToneReprCurve::Lut(vec![9, 9, 9]));
    let mut many = adobe.clone();
    many[128..132].fill(0xff);
    let mut text = ColorProfile::new_adobe_rgb();
    text.copyright = Some(ProfileText::PlainString("x".into()));
    assert_eq!(seen(&with_profile(3, &text)), [227.0, 100.0, 42.0]);
    let cases = [
        (vec![0; icc::MOST_BYTES + 1], "is larger than 4 MiB"),
        (many, "has 4294967295 entries; 100 are read"),
        (Vec::new(), "is damaged"),
        (adobe[..100].to_vec(), "is damaged"),
        (adobe[..300].to_vec(), "is damaged"),
        (tables.encode().unwrap(), "is made of tables for all channels together, not of a matrix and curves"),
        (black.encode().unwrap(), "has primaries of no colours"),
        (flat.encode().unwrap(), "has curves that do not rise from black to white"),
        (ColorProfile::new_gray_with_gamma(2.2).encode().unwrap(), "is one of grey, and the picture has colours"),
    ];
    for (icc, why) in cases {
        let header = Header { icc: Some(icc), ..header(3, SampleKind::U16) };
        let (conversion, unused) = Conversion::of_file(&header);
        assert_eq!(unused, [format!("its ICC profile {why}; its colours are taken as sRGB")]);
        assert_eq!(conversion, ColorSpace::Srgb.into());
    }
}

#[test]
fn never_panics_at_a_changed_profile() {
    let adobe = ColorProfile::new_adobe_rgb().encode().unwrap();
    for at in 0..adobe.len() {
        for byte in [0, 0x7f, 0xff] {
            let mut icc = adobe.clone();
            icc[at] = byte;
            let (conversion, _) = Conversion::of_file(&Header { icc: Some(icc), ..header(3, SampleKind::U8) });
            let mut picture = picture(3, SampleKind::U8, vec![0.0, 0.5, 1.0]);
            conversion.apply(&mut picture);
            assert_eq!(picture.count_non_finite(), 0, "byte {at} is {byte}");
        }
    }
}

#[test]
fn follows_the_order_of_png() {
    let all = HeaderStatements {
        cicp: Some([12, 13, 0, 1]),
        srgb: true,
        gamma: Some(100_000),
        chromaticities: Some([0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.329]),
        ..HeaderStatements::default()
    };
    let adobe = ColorProfile::new_adobe_rgb().encode().unwrap();
    let mut header = Header { icc: Some(adobe), told: all, ..header(3, SampleKind::U8) };
    assert_eq!(seen(&header), [215.0, 93.0, 31.0]);
    header.told.cicp = None;
    assert_eq!(seen(&header), [227.0, 100.0, 42.0]);
    header.icc = None;
    assert_eq!(seen(&header), [200.0, 100.0, 50.0]);
    header.told.srgb = false;
    let linear = seen(&header);
    header.told.chromaticities = None;
    assert_eq!(seen(&header), [229.0, 168.0, 122.0]);
    assert!(linear[0] > 229.0, "{linear:?}");
    // A file that is also marked for programs that do not know the chunk `sRGB`.
    header.told.gamma = Some(45_455);
    assert_eq!(Conversion::of_file(&header).0, ColorSpace::Srgb.into());
}

#[test]
fn uses_the_next_statement_if_one_is_unknown() {
    let told = HeaderStatements { cicp: Some([2, 2, 0, 1]), ..HeaderStatements::default() };
    let adobe = Some(ColorProfile::new_adobe_rgb().encode().unwrap());
    let (conversion, unused) = Conversion::of_file(&Header { told, icc: adobe.clone(), ..header(3, SampleKind::U8) });
    assert_eq!(conversion, Conversion::of_file(&Header { icc: adobe, ..header(3, SampleKind::U8) }).0);
    let expected =
        "its `cICP` names primaries `2`, which are not known; what else it says of its colours is used instead";
    assert_eq!(unused, [expected]);
}

#[test]
fn divides_colours_by_opacity() {
    let mut straight = picture(4, SampleKind::F32, vec![0.2, 0.3, 0.7, 0.1, 0.1, 0.1, 0.0, 0.0, 0.0, 0.5, 1.0, 0.0]);
    divide_by_alpha(&mut straight);
    assert_eq!(straight.planes, [0.4, 0.3, 0.7, 0.2, 0.1, 0.1, 0.0, 0.0, 0.0, 0.5, 1.0, 0.0]);
    // By rounding, a colour can exceed its opacity. A quotient between two codes is converted exactly.
    let mut codes = picture(4, SampleKind::U8, [129.0, 50.0, 0.0, 128.0].map(|code| code / 255.0).to_vec());
    divide_by_alpha(&mut codes);
    Conversion::from(ColorSpace::Srgb).apply(&mut codes);
    assert_eq!(codes.planes[..2], [1.0, linear_sample((50.0 / 255.0) / (128.0_f32 / 255.0))]);
}
