//! A small built-in font: letters of 5 × 7 dots, plus two rows below the baseline.
//!
//! Adjacent dots are joined by strokes, so that text is round and smooth at any size.

/// A character's strokes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Glyph {
    /// Width of the character in columns.
    pub width: usize,
    /// From dot to dot: column and row of both ends, row 0 at the top of capitals, row 6 on the
    /// baseline.
    pub strokes: Vec<[[f64; 2]; 2]>,
}

/// Number of rows of capitals and digits.
pub(super) const CAPITAL_ROWS: f64 = 7.0;

/// Width of a space in columns.
const SPACE: usize = 3;

/// The strokes of a character; an empty box for a character that the font does not have.
pub(super) fn glyph(character: char) -> Glyph {
    if character == ' ' {
        return Glyph { width: SPACE, strokes: Vec::new() };
    }
    let dots = DOTS.iter().find(|(known, _)| *known == character).map_or(UNKNOWN, |(_, dots)| dots);
    let rows: Vec<&[u8]> = dots.split('/').map(str::as_bytes).collect();
    let set = |r: usize, c: usize| rows.get(r).and_then(|row| row.get(c)).is_some_and(|dot| *dot == b'#');
    let columns = rows.iter().map(|row| row.len()).max().unwrap_or(0);
    let first = (0..columns).find(|&c| (0..rows.len()).any(|r| set(r, c))).unwrap_or(0);
    let last = (0..columns).rfind(|&c| (0..rows.len()).any(|r| set(r, c))).unwrap_or(0);
    let at = |r: usize, c: usize| [(c - first) as f64, r as f64];
    let mut strokes = Vec::new();
    for r in 0..rows.len() {
        for c in (first..=last).filter(|&c| set(r, c)) {
            let mut join = |r2: usize, c2: usize| strokes.push([at(r, c), at(r2, c2)]);
            if set(r, c + 1) {
                join(r, c + 1);
            }
            if set(r + 1, c) {
                join(r + 1, c);
            }
            // Use a diagonal only if no straight path leads to the same dot.
            if set(r + 1, c + 1) && !set(r, c + 1) && !set(r + 1, c) {
                join(r + 1, c + 1);
            }
            if c > first && set(r + 1, c - 1) && !set(r, c - 1) && !set(r + 1, c) {
                join(r + 1, c - 1);
            }
        }
    }
    let joined = |p: [f64; 2]| strokes.iter().flatten().any(|end| *end == p);
    let all = (0..rows.len()).flat_map(|r| (first..=last).map(move |c| (r, c)));
    let alone: Vec<[f64; 2]> = all.filter(|&(r, c)| set(r, c)).map(|(r, c)| at(r, c)).filter(|p| !joined(*p)).collect();
    strokes.extend(alone.into_iter().map(|p| [p, p]));
    Glyph { width: last - first + 1, strokes }
}

/// Width of a text in columns, with one empty column between characters.
pub(super) fn columns(text: &str) -> f64 {
    let all: usize = text.chars().map(|c| glyph(c).width + 1).sum();
    all.saturating_sub(1) as f64
}

const UNKNOWN: &str = "#####/#...#/#...#/#...#/#...#/#...#/#####";

/// Rows from top to bottom.
const DOTS: &[(char, &str)] = &[
    ('!', "#/#/#/#/#/./#"),
    ('"', "#.#/#.#/...."),
    ('#', ".#.#./.#.#./#####/.#.#./#####/.#.#./.#.#."),
    ('$', "..#../.####/#.#../.###./..#.#/####./..#.."),
    ('%', "##..#/##..#/...#./..#../.#.../#..##/#..##"),
    ('&', ".##../#..#./#.#../.#.../#.#.#/#..#./.##.#"),
    ('\'', "#/#/."),
    ('(', "..#/.#./#../#../#../.#./..#"),
    (')', "#../.#./..#/..#/..#/.#./#.."),
    ('*', "...../#.#.#/.###./#####/.###./#.#.#"),
    ('+', "...../..#../..#../#####/..#../..#.."),
    (',', "../../../../../.#/.#/#."),
    ('-', ".../.../.../###"),
    ('.', "./././././#/#"),
    ('/', "....#/....#/...#./..#../.#.../#..../#...."),
    ('0', ".###./#...#/#...#/#...#/#...#/#...#/.###."),
    ('1', ".#./##./.#./.#./.#./.#./###"),
    ('2', ".###./#...#/....#/...#./..#../.#.../#####"),
    ('3', ".###./#...#/....#/..##./....#/#...#/.###."),
    ('4', "...#./..##./.#.#./#..#./#####/...#./...#."),
    ('5', "#####/#..../####./....#/....#/#...#/.###."),
    ('6', ".###./#..../#..../####./#...#/#...#/.###."),
    ('7', "#####/....#/...#./...#./..#../..#../..#.."),
    ('8', ".###./#...#/#...#/.###./#...#/#...#/.###."),
    ('9', ".###./#...#/#...#/.####/....#/....#/.###."),
    (':', "././#/./././#"),
    (';', "../../.#/../../.#/.#/#."),
    ('<', ".../..#/.#./#../.#./..#"),
    ('=', "..../..../####/..../####"),
    ('>', ".../#../.#./..#/.#./#.."),
    ('?', ".###./#...#/....#/...#./..#../...../..#.."),
    ('@', ".###./#...#/#.###/#.#.#/#.###/#..../.####"),
    ('A', "..#../.#.#./#...#/#...#/#####/#...#/#...#"),
    ('B', "####./#...#/#...#/####./#...#/#...#/####."),
    ('C', ".###./#...#/#..../#..../#..../#...#/.###."),
    ('D', "####./#...#/#...#/#...#/#...#/#...#/####."),
    ('E', "#####/#..../#..../####./#..../#..../#####"),
    ('F', "#####/#..../#..../####./#..../#..../#...."),
    ('G', ".###./#...#/#..../#.###/#...#/#...#/.###."),
    ('H', "#...#/#...#/#...#/#####/#...#/#...#/#...#"),
    ('I', "###/.#./.#./.#./.#./.#./###"),
    ('J', "..###/...#./...#./...#./...#./#..#./.##.."),
    ('K', "#...#/#..#./#.#../##.../#.#../#..#./#...#"),
    ('L', "#..../#..../#..../#..../#..../#..../#####"),
    ('M', "#...#/##.##/#.#.#/#.#.#/#...#/#...#/#...#"),
    ('N', "#...#/##..#/#.#.#/#.#.#/#..##/#...#/#...#"),
    ('O', ".###./#...#/#...#/#...#/#...#/#...#/.###."),
    ('P', "####./#...#/#...#/####./#..../#..../#...."),
    ('Q', ".###./#...#/#...#/#...#/#.#.#/#..#./.##.#"),
    ('R', "####./#...#/#...#/####./#.#../#..#./#...#"),
    ('S', ".###./#...#/#..../.###./....#/#...#/.###."),
    ('T', "#####/..#../..#../..#../..#../..#../..#.."),
    ('U', "#...#/#...#/#...#/#...#/#...#/#...#/.###."),
    ('V', "#...#/#...#/#...#/#...#/.#.#./.#.#./..#.."),
    ('W', "#...#/#...#/#...#/#.#.#/#.#.#/##.##/#...#"),
    ('X', "#...#/#...#/.#.#./..#../.#.#./#...#/#...#"),
    ('Y', "#...#/#...#/.#.#./..#../..#../..#../..#.."),
    ('Z', "#####/....#/...#./..#../.#.../#..../#####"),
    ('[', "##/#./#./#./#./#./##"),
    ('\\', "#..../#..../.#.../..#../...#./....#/....#"),
    (']', "##/.#/.#/.#/.#/.#/##"),
    ('^', "..#../.#.#./#...#"),
    ('_', "...../...../...../...../...../...../#####"),
    ('`', "#./.#"),
    ('a', "..../..../.##./...#/.###/#..#/.###"),
    ('b', "#.../#.../###./#..#/#..#/#..#/###."),
    ('c', "..../..../.###/#.../#.../#.../.###"),
    ('d', "...#/...#/.###/#..#/#..#/#..#/.###"),
    ('e', "..../..../.##./#..#/####/#.../.##."),
    ('f', ".##/#../###/#../#../#../#.."),
    ('g', "..../..../.###/#..#/#..#/#..#/.###/...#/.##."),
    ('h', "#.../#.../###./#..#/#..#/#..#/#..#"),
    ('i', "#/./#/#/#/#/#"),
    ('j', ".#/../.#/.#/.#/.#/.#/.#/#."),
    ('k', "#.../#.../#..#/#.#./##../#.#./#..#"),
    ('l', "#./#./#./#./#./#./.#"),
    ('m', "...../...../####./#.#.#/#.#.#/#.#.#/#.#.#"),
    ('n', "..../..../###./#..#/#..#/#..#/#..#"),
    ('o', "..../..../.##./#..#/#..#/#..#/.##."),
    ('p', "..../..../###./#..#/#..#/#..#/###./#.../#..."),
    ('q', "..../..../.###/#..#/#..#/#..#/.###/...#/...#"),
    ('r', ".../.../#.#/##./#../#../#.."),
    ('s', "..../..../.###/#.../.##./...#/###."),
    ('t', "#../#../###/#../#../#../.##"),
    ('u', "..../..../#..#/#..#/#..#/#..#/.###"),
    ('v', "...../...../#...#/#...#/.#.#./.#.#./..#.."),
    ('w', "...../...../#...#/#.#.#/#.#.#/#.#.#/.#.#."),
    ('x', "...../...../#...#/.#.#./..#../.#.#./#...#"),
    ('y', "..../..../#..#/#..#/#..#/#..#/.###/...#/.##."),
    ('z', "..../..../####/...#/.##./#.../####"),
    ('{', "..#/.#./.#./#../.#./.#./..#"),
    ('|', "#/#/#/#/#/#/#"),
    ('}', "#../.#./.#./..#/.#./.#./#.."),
    ('~', "...../...../.#.../#.#.#/...#."),
    ('°', ".#./#.#/.#."),
    ('²', "##./..#/.#./#../###"),
    ('³', "##./..#/.#./..#/##."),
    ('·', "./././#"),
    ('×', "...../...../#...#/.#.#./..#../.#.#./#...#"),
    ('−', "..../..../..../####"),
    ('–', "..../..../..../####"),
    ('µ', "..../..../#..#/#..#/#..#/#..#/####/#.../#..."),
    ('μ', "...../...../#...#/#...#/#...#/#..##/###.#/#..../#...."),
    ('ε', ".../.../.##/#../.#./#../.##"),
    ('θ', ".##./#..#/#..#/####/#..#/#..#/.##."),
    ('ρ', "..../..../.##./#..#/#..#/#..#/###./#.../#..."),
    ('σ', "...../...../.####/#..#./#..#./#..#./.##.."),
    ('φ', "..#../..#../.###./#.#.#/#.#.#/#.#.#/.###./..#../..#.."),
    ('≥', "#.../.##./...#/.##./#.../..../####"),
    ('≤', "...#/.##./#.../.##./...#/..../####"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printable_characters_have_glyphs_of_their_own() {
        let beyond = "°²³·×−µθρσφ≥≤";
        let all: Vec<char> = ('!'..='~').chain(beyond.chars()).collect();
        for (i, &character) in all.iter().enumerate() {
            let own = glyph(character);
            assert_ne!(own, glyph('\u{1F41F}'), "{character} is an unknown character");
            // Only these may look alike: the context distinguishes them.
            let twin = all[..i].iter().find(|&&other| glyph(other) == own);
            let known = matches!((character, twin), ('O', Some('0')) | ('×', Some('x')));
            assert!(twin.is_none() || known, "{character} looks like {twin:?}");
        }
    }

    #[test]
    fn strokes_stay_within_the_glyph() {
        for (character, _) in DOTS {
            let glyph = glyph(*character);
            assert!(!glyph.strokes.is_empty() && glyph.width <= 5, "{character}");
            for [column, row] in glyph.strokes.into_iter().flatten() {
                assert!((0.0..=(glyph.width - 1) as f64).contains(&column), "{character}");
                assert!((0.0..=8.0).contains(&row), "{character}");
            }
        }
    }

    #[test]
    fn dots_are_joined_straight_before_diagonally() {
        // A plus of five by five dots: two bars of four strokes, no diagonals at its middle.
        let plus = glyph('+');
        assert_eq!(plus.strokes.len(), 8);
        assert!(plus.strokes.iter().all(|[a, b]| a[0] == b[0] || a[1] == b[1]));
        // The cross of x has nothing but diagonals.
        let cross = glyph('x');
        assert_eq!(cross.strokes.len(), 8);
        assert!(cross.strokes.iter().all(|[a, b]| a[0] != b[0] && a[1] != b[1]));
        // The point over i stands alone.
        assert_eq!(glyph('i').strokes.iter().filter(|[a, b]| a == b).count(), 1);
    }

    #[test]
    fn columns_count_gaps_between_characters_only() {
        assert_eq!(columns(""), 0.0);
        assert_eq!(columns("0"), 5.0);
        assert_eq!(columns("00"), 11.0);
        assert_eq!(columns("1.5"), 3.0 + 1.0 + 1.0 + 1.0 + 5.0);
    }
}
