use shibo_engine::picture::*;
fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/self/stat").unwrap();
    let f: Vec<&str> = s.rsplit_once(')').unwrap().1.split_whitespace().collect();
    (f[11].parse::<f64>().unwrap() + f[12].parse::<f64>().unwrap()) / 100.0
}
fn peak() -> String {
    std::fs::read_to_string("/proc/self/status").unwrap().lines().find(|l| l.starts_with("VmHWM")).unwrap().to_string()
}
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let n: u32 = a[1].parse().unwrap();
    let format = match a[2].as_str() {
        "png" => Format::Png,
        "tiff" => Format::Tiff,
        _ => Format::Exr,
    };
    let depth = match a[3].as_str() {
        "8" => Depth::U8,
        "16" => Depth::U16,
        "f16" => Depth::F16,
        _ => Depth::F32,
    };
    let ch: usize = a[4].parse().unwrap();
    let compression = if a[5] == "best" { Compression::Best } else { Compression::Fast };
    let rows = 64u32;
    let w = n as usize;
    // leather-like: smooth relief, fine grain
    let mut planes = vec![vec![0f32; w * rows as usize]; ch];
    for (c, p) in planes.iter_mut().enumerate() {
        for (i, v) in p.iter_mut().enumerate() {
            let (x, y) = ((i % w) as f32, (i / w) as f32);
            let h = (((i as u32).wrapping_mul(2654435761).wrapping_add(c as u32)) >> 9) as f32 / 8388608.0;
            *v = 0.5
                + 0.3 * (x * 0.013).sin() * (y * 0.098).sin()
                + 0.1 * (x * 0.11 + y * 0.09 + c as f32).sin()
                + 0.004 * h;
        }
    }
    let refs: Vec<&[f32]> = planes.iter().map(|p| &p[..]).collect();
    let spec = PictureSpec {
        width: n,
        height: n,
        channels: (0..ch).map(|c| format!("c{c}")).collect(),
        format,
        depth,
        encoding: Encoding {
            transfer: if ch >= 3 && std::env::var("RAW").is_err() { Transfer::Srgb } else { Transfer::Raw },
            range: None,
            dither: a.get(6).is_some_and(|d| d == "dither"),
        },
        compression,
        metadata: vec![("Software".into(), "x".into())],
    };
    let path = std::path::PathBuf::from(format!("/dev/shm/speed.{}", format.extension()));
    let t = std::time::Instant::now();
    let c = cpu();
    let mut wr = Writer::create(&path, &spec).unwrap();
    while wr.next_row() < n {
        wr.write_rows(&refs, rows.min(n - wr.next_row())).unwrap();
    }
    let done = wr.finish().unwrap();
    let raw = n as f64 * n as f64 * ch as f64 * depth.bytes() as f64;
    println!(
        "{a:?} wall {:.2} cpu {:.2} ratio {:.3} MB {:.0} {} bandsMB {:.0}",
        t.elapsed().as_secs_f64(),
        cpu() - c,
        done.bytes as f64 / raw,
        done.bytes as f64 / 1e6,
        peak(),
        (w * rows as usize * ch * 4) as f64 / 1e6
    );
    if a.get(7).is_some() {
        let t = std::time::Instant::now();
        let c = cpu();
        let p = read(&path, &ReadLimits { max_bytes_decoded: 16 << 30, ..Default::default() }).unwrap();
        println!(
            "read {}x{}x{} wall {:.2} cpu {:.2} {}",
            p.width,
            p.height,
            p.channels,
            t.elapsed().as_secs_f64(),
            cpu() - c,
            peak()
        );
    }
    std::fs::remove_file(path).unwrap();
}
