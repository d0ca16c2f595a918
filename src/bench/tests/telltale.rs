//! Whether a sealed case tells its label beside its signals: times, sizes, names and order of its files, held against the labels.
//!
//! A classifier by the five nearest of the other cases, in each column alone and in all together. The most that one of them
//! gets right is held against the same with labels in random order.

use crate::bench::folder::names;
use crate::bench::worlds::{Label, Mix};
use crate::bench::{Order, make};
use crate::config::Kind;
use crate::math::cases::cases;
use crate::math::random::Stream;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

const NEAREST: usize = 5;
const SHUFFLES: usize = 2000;
/// Fewest cases with which a time that tells is seen.
const FEWEST: u64 = 60;
/// Probability that a bench that tells nothing fails.
const CHANCE: f64 = 1e-3;

/// None, one, two, or one in no list.
fn sort(label: &Label) -> usize {
    match label.effects.keys().next() {
        None => 0,
        Some(id) if id.starts_with("x.") => 3,
        Some(_) => label.effects.len().min(2),
    }
}

/// Place in the folder's own order, number in the name, files, their sizes in bytes and times in s.
fn facts(folder: &Path, name: &str) -> Vec<f64> {
    let since = |t: std::io::Result<SystemTime>| t.map_or(0.0, |t| t.duration_since(UNIX_EPOCH).unwrap().as_secs_f64());
    let at = std::fs::read_dir(folder).unwrap().position(|e| e.unwrap().file_name().to_string_lossy() == name).unwrap();
    let mut sizes = [0.0; 2];
    let (mut changed, mut begun, mut count) = (0.0_f64, 0.0_f64, 0.0);
    for file in std::fs::read_dir(folder.join(name)).unwrap() {
        let file = file.unwrap();
        let about = file.metadata().unwrap();
        let held_out = file.file_name().to_string_lossy().starts_with("hold");
        sizes[usize::from(held_out)] += about.len() as f64;
        changed = changed.max(since(about.modified()));
        begun = begun.max(since(about.created()));
        count += 1.0;
    }
    let number: f64 = name.rsplit('-').next().unwrap().parse().unwrap();
    vec![at as f64, number, count, sizes[0], sizes[1], changed, begun]
}

/// Each column by its ranks, from 0 to 1; equal numbers have one rank.
fn ranked(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let column = |j: usize| rows.iter().map(move |row| row[j]);
    let rank = |j: usize, v: f64| column(j).filter(|w| *w < v).count() as f64 / rows.len() as f64;
    rows.iter().map(|row| (0..row.len()).map(|j| rank(j, row[j])).collect()).collect()
}

/// For each row the nearest others, in these columns.
fn neighbours(rows: &[Vec<f64>], columns: std::ops::Range<usize>) -> Vec<Vec<usize>> {
    let distance = |i: usize, k: usize| columns.clone().map(|j| (rows[i][j] - rows[k][j]).powi(2)).sum::<f64>();
    let nearest = |i: usize| {
        let mut others: Vec<usize> = (0..rows.len()).filter(|k| *k != i).collect();
        others.sort_by(|a, b| distance(i, *a).total_cmp(&distance(i, *b)));
        others.truncate(NEAREST);
        others
    };
    (0..rows.len()).map(nearest).collect()
}

fn right(neighbours: &[Vec<usize>], sorts: &[usize]) -> usize {
    let guess = |near: &Vec<usize>| {
        let votes = |sort: usize| near.iter().filter(|k| sorts[**k] == sort).count();
        (0..4).rev().max_by_key(|sort| votes(*sort)).unwrap()
    };
    neighbours.iter().zip(sorts).filter(|(near, sort)| guess(near) == **sort).count()
}

/// Probability of as many right guesses in a random order of the labels, by whichever columns guess best.
fn p_value(rows: &[Vec<f64>], sorts: &[usize]) -> f64 {
    let (rows, count) = (ranked(rows), rows[0].len());
    let mut classifiers: Vec<_> = (0..count).map(|j| neighbours(&rows, j..j + 1)).collect();
    classifiers.push(neighbours(&rows, 0..count));
    let most = |sorts: &[usize]| classifiers.iter().map(|near| right(near, sorts)).max().unwrap_or(0);
    let found = most(sorts);
    let (mut shuffled, mut draw) = (sorts.to_vec(), Stream::new(1, 0));
    let mut as_many = 1;
    for _ in 0..SHUFFLES {
        draw.shuffle(&mut shuffled);
        as_many += usize::from(most(&shuffled) >= found);
    }
    println!("{found} of {} right, p = {:.4}", sorts.len(), as_many as f64 / (SHUFFLES + 1) as f64);
    as_many as f64 / (SHUFFLES + 1) as f64
}

fn tells_nothing(kind: Kind, cases: usize) {
    let folder = tempfile::tempdir().unwrap();
    let bench = folder.path().join("bench");
    let mix = Mix { cases, none: 0.25, pairs: 0.25, unlisted: 0.25, messy: 0.5, habits: 0.3 };
    let made = make(&bench, &Order { kind, mix, seed: Some(11) }, |_, _| {}).unwrap();
    let by_name: BTreeMap<&String, usize> = made.labels.iter().map(|(name, label)| (name, sort(label))).collect();
    let names = names(&bench).unwrap();
    let sorts: Vec<usize> = names.iter().map(|name| by_name[name]).collect();
    let mut rows: Vec<Vec<f64>> = names.iter().map(|name| facts(&bench, name)).collect();
    assert!(rows.iter().all(|row| row[5] == rows[0][5]), "all files have one time of change");
    assert!(p_value(&rows, &sorts) > CHANCE);
    // it would see a time that tells the label
    rows.iter_mut().zip(&sorts).for_each(|(row, sort)| row[5] += *sort as f64);
    assert!(p_value(&rows, &sorts) <= CHANCE);
}

#[test]
#[ignore = "battery: makes 320 cases"]
fn battery_files_at_rest_tell_nothing_of_the_label() {
    tells_nothing(Kind::Stationary, cases(320).max(FEWEST) as usize);
}

#[test]
#[ignore = "battery: makes 160 cases"]
fn battery_files_of_drives_tell_nothing_of_the_label() {
    tells_nothing(Kind::Driving, cases(160).max(FEWEST) as usize);
}
