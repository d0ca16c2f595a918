//! Files that were made to fill a memory, or to be read for ever: promises of rows that are not there, content that unpacks to
//! a thousand times its size, nesting without end. Smaller ones lie in the corpus.

use crate::entry::{answer, config, expression, log, robot};
use crate::found::run;
use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use std::io::{Read, Write, repeat};

/// More than a small file may unpack to.
const TOO_MUCH: u64 = 128 << 20;
/// Nesting that no parser goes down on its stack.
const DEEP: usize = 20_000;

fn array(descr: &str, shape: &str) -> Vec<u8> {
    let header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}");
    let header = format!("{header:<117}\n");
    [&b"\x93NUMPY\x01\x00"[..], &(header.len() as u16).to_le_bytes(), header.as_bytes(), &[0; 64]].concat()
}

/// A record of MCAP, in a file that holds nothing else.
fn mcap(opcode: u8, length: u64, body: &[u8]) -> Vec<u8> {
    [&b"\x89MCAP0\r\n"[..], &[opcode], &length.to_le_bytes(), body, b"\x89MCAP0\r\n"].concat()
}

/// A chunk of MCAP that says it holds `size` bytes.
fn chunk(size: u64, packing: &str, packed: &[u8]) -> Vec<u8> {
    let lengths = [(packing.len() as u32).to_le_bytes().as_slice(), packing.as_bytes()].concat();
    let packed_bytes = (packed.len() as u64).to_le_bytes();
    let body = [&[0; 16][..], &size.to_le_bytes(), &[0; 4], &lengths, &packed_bytes, packed].concat();
    mcap(6, body.len() as u64, &body)
}

/// A variable of MATLAB 5, alone in a file.
fn matlab(kind: u32, body: &[u8]) -> Vec<u8> {
    let mut file = format!("{:<124}", "MATLAB 5.0 MAT-file").into_bytes();
    file.extend(b"\x00\x01IM");
    [&file[..], &kind.to_le_bytes(), &(body.len() as u32).to_le_bytes(), body].concat()
}

/// The head of a matrix of numbers of these sides.
fn matrix(rows: i32, columns: i32) -> Vec<u8> {
    let words = |all: &[u32]| all.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<u8>>();
    let sides = words(&[5, 8, rows.cast_unsigned(), columns.cast_unsigned()]);
    [words(&[6, 8, 6, 0]), sides, words(&[1, 4]), b"gyro\0\0\0\0".to_vec(), words(&[9, 0])].concat()
}

/// A message of ULog.
fn message(kind: u8, body: &[u8]) -> Vec<u8> {
    [&(body.len() as u16).to_le_bytes()[..], &[kind], body].concat()
}

#[test]
fn promises_of_rows_that_are_not_there() {
    for (descr, shape) in [
        ("'<f8'", "(1152921504606846976,)"),
        ("'<f8'", "(4294967296, 4294967296, 4294967296)"),
        ("'<f8'", "(0, 1152921504606846976)"),
        ("'|V0'", "(1152921504606846976,)"),
        ("'|S0'", "(1152921504606846976, 3)"),
        ("'|O'", "(1152921504606846976,)"),
        ("'<f4611686018427387904'", "(0,)"),
        ("[('o', '|O'), ('gyro', '<f4611686018427387904')]", "(2,)"),
        ("[('t', '<f8'), ('gyro', '<f8', (1152921504606846976,))]", "(2,)"),
        ("[('t', '<f8'), ('gyro', '<f8', (3, 1152921504606846976))]", "(1152921504606846976,)"),
        ("[('t', '|V0'), ('gyro', '<f8', (0,))]", "(1152921504606846976,)"),
    ] {
        run(log, &array(descr, shape), &format!("{descr} of {shape}"));
    }
    run(log, &matlab(14, &matrix(i32::MAX, i32::MAX)), "a matrix of 2^62 numbers");
    run(log, &matlab(14, &matrix(-1, -1)), "a matrix of less than no numbers");
    for length in [1 << 30, 1 << 60, u64::MAX] {
        run(log, &mcap(5, length, &[0; 40]), "a message of MCAP");
        for packing in ["", "lz4", "zstd"] {
            run(log, &chunk(length, packing, &[0; 40]), "a chunk of MCAP");
        }
    }
    let bag = |header: &[u8], size: u32| {
        let length = (header.len() as u32).to_le_bytes();
        [&b"#ROSBAG V2.0\n"[..], &length, header, &size.to_le_bytes(), &[0; 40]].concat()
    };
    for size in [1 << 28, u32::MAX] {
        let packed = [&b"\x04\0\0\0op=\x05\x0f\0\0\0compression=bz2\x09\0\0\0size="[..], &size.to_le_bytes()].concat();
        run(log, &bag(&packed, 40), "a chunk of a bag");
        run(log, &bag(b"\x04\0\0\0op=\x02", size), "a message of a bag");
    }
    let ulog = |messages: Vec<u8>| [&b"ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0"[..], &messages].concat();
    for count in ["1152921504606846976", "18446744073709551616"] {
        let format = message(b'F', format!("imu:uint64_t timestamp;float[{count}] gyro_rad;").as_bytes());
        run(log, &ulog([format, message(b'A', b"\0\0\0imu"), message(b'D', &[0; 40])].concat()), "a format of ULog");
    }
    // a format of many fields that is logged under every number
    let format = message(b'F', b"imu:uint64_t timestamp;uint8_t[1000] gyro_rad;");
    let logged = (0..=u16::MAX).flat_map(|id| message(b'A', &[&[0u8][..], &id.to_le_bytes(), b"imu"].concat()));
    run(log, &ulog(format.into_iter().chain(logged).collect()), "a format of ULog, 65536 times");
}

#[test]
fn content_that_unpacks_to_a_thousand_times_its_size() {
    // a gzip file may have many members: one megabyte, again and again
    let gzip = |unit: &[u8], head: &[u8]| {
        let member = |bytes: &[u8]| {
            let mut out = GzEncoder::new(Vec::new(), Compression::best());
            out.write_all(bytes).unwrap();
            out.finish().unwrap()
        };
        [member(head), member(&unit.repeat(1 << 20)).repeat((TOO_MUCH >> 20) as usize)].concat()
    };
    run(log, &gzip(b"1", b"t_s,gyro_z_rad_s\n"), "a line without end");
    run(log, &gzip(b"[", b"{\"t_s\":"), "lists without end");
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated)
        .compression_level(Some(9));
    zip.start_file("gyro.npy", options).unwrap();
    let header = array("'<f8'", &format!("({},)", TOO_MUCH / 8));
    zip.write_all(&header[..header.len() - 64]).unwrap();
    std::io::copy(&mut repeat(0).take(TOO_MUCH), &mut zip).unwrap();
    run(log, &zip.finish().unwrap().into_inner(), "an array of zeros");
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::best());
    packed.write_all(&[14, 0, 0, 0, 0, 0, 0, 10]).unwrap();
    std::io::copy(&mut repeat(0).take(TOO_MUCH), &mut packed).unwrap();
    run(log, &matlab(15, &packed.finish().unwrap()), "a variable of zeros");
    let packed = zstd::stream::encode_all(repeat(0).take(TOO_MUCH), 1).unwrap();
    run(log, &chunk(TOO_MUCH, "zstd", &packed), "a chunk of zeros");
}

#[test]
fn columns_that_hardly_any_row_has() {
    let keys: Vec<String> = (0..3000).map(|i| format!("\"k{i}\":1")).collect();
    let rows = "{}\n".repeat(30_000);
    run(log, format!("{{\"t_s\":0,\"gyro_z_rad_s\":1,{}}}\n{rows}", keys.join(",")).as_bytes(), "JSON lines");
    run(log, format!("{}1\n", "1,".repeat(5000)).repeat(3).as_bytes(), "CSV");
}

#[test]
fn nesting_without_end() {
    let nested = |open: &str, inside: &str, close: &str| open.repeat(DEEP) + inside + &close.repeat(DEEP);
    for text in [
        format!("schema = {}", nested("[", "1", "]")),
        format!("schema = {}", nested("{a=", "1", "}")),
        format!("schema = 1\n[{}a]\n", "a.".repeat(DEEP)),
        format!("schema = 1\n{}a = 1\n", "a.".repeat(DEEP)),
    ] {
        run(config, text.as_bytes(), &text[..20]);
    }
    for text in [nested("[", "1", "]"), nested("{\"a\":", "1", "}")] {
        run(answer, text.as_bytes(), &text[..5]);
        run(log, format!("{{\"t_s\":{text}}}\n").as_bytes(), &text[..5]);
    }
    for (tag, inside) in [("robot", "link"), ("sdf", "model"), ("mujoco", "worldbody"), ("mujoco", "body")] {
        let (open, close) = (format!("<{inside} name='a'>"), format!("</{inside}>"));
        let text = nested(&open, "", &close);
        run(robot, format!("<{tag}>{text}</{tag}>").as_bytes(), tag);
        run(robot, format!("<{tag}><default>{text}</default></{tag}>").as_bytes(), tag);
    }
    let entities: String =
        (0..30).map(|i| format!("<!ENTITY e{} \"&e{i};&e{i};&e{i};&e{i};&e{i};&e{i};&e{i};&e{i};\">", i + 1)).collect();
    let text = format!("<!DOCTYPE robot [<!ENTITY e0 \"x\">{entities}]><robot name=\"&e30;\">&e30;</robot>");
    run(robot, text.as_bytes(), "entities in entities");
    // joints that hang on each other: a chain, and a ring
    for (count, ring) in [(500, false), (500, true), (3000, false)] {
        let joint = |i: usize| {
            let child = if ring { (i + 1) % count } else { i + 1 };
            format!(
                "<link name='l{i}'/><joint name='wheel{i}' type='continuous'><parent link='l{i}'/><child link='l{child}'/></joint>"
            )
        };
        let text: String = (0..count).map(joint).collect();
        run(robot, format!("<robot name='r'>{text}<link name='l{count}'/></robot>").as_bytes(), "joints on joints");
    }
    for text in [nested("(", "k", ")"), nested("sin(", "k", ")"), "-".repeat(DEEP), "k*t_s+".repeat(60) + "k*t_s"] {
        run(expression, text.as_bytes(), &text[..5]);
    }
}
