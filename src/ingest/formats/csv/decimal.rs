//! Plain decimals (`-12.345`) as floats, eight digits at a time; anything else is left to others.
//!
//! The digits are a whole number, which is multiplied by a reciprocal power of ten that is cut off at 128 bits and rounded to
//! even: Lemire, Number parsing at a gigabyte per second, Software: Practice and Experience 51 (2021), whose section 8 shows
//! that this decides for up to 27 decimals.

/// Decimals of the longest number.
const MOST_DECIMALS: usize = 27;

/// A number as it is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Decimal {
    pub value: f64,
    /// Characters.
    pub length: usize,
    /// Digits behind the point.
    pub decimals: usize,
    /// All digits as one whole number.
    digits: u64,
}

impl Decimal {
    /// Digits from the first that is not zero.
    pub(crate) fn significant(&self) -> u32 {
        self.digits.checked_ilog10().map_or(0, |last| last + 1)
    }
}

/// The number that `text` begins with, if it is a plain decimal of at most 27 decimals whose digits are a whole number of
/// 64 bits. What follows it is not looked at, but has to be there.
#[inline(always)]
pub(crate) fn parse(text: &[u8]) -> Option<Decimal> {
    // the processor guesses the sign sooner than it knows where the digits begin
    match text.first()? {
        b'-' => parse_from::<1>(text),
        _ => parse_from::<0>(text),
    }
}

/// The number whose digits begin behind `FIRST` characters of sign.
#[inline(always)]
fn parse_from<const FIRST: usize>(text: &[u8]) -> Option<Decimal> {
    let window: &[u8; WINDOW] = text.first_chunk()?;
    let mut at = FIRST;
    let mut digits: u64 = 0;
    loop {
        let digit = window[at].wrapping_sub(b'0');
        if digit > 9 {
            break;
        }
        digits = 10 * digits + u64::from(digit);
        at += 1;
        if at == MOST_WHOLE {
            return None;
        }
    }
    if at == FIRST {
        return None;
    }
    let mut decimals = 0;
    if window[at] == b'.' {
        at += 1;
        let begin = at;
        let mut eight = u64::from_le_bytes(*window[at..].first_chunk()?);
        let mut count = leading_digits(eight);
        while count == 8 {
            digits = digits.checked_mul(100_000_000)?.checked_add(eight_digits(eight))?;
            at += 8;
            eight = u64::from_le_bytes(*window.get(at..)?.first_chunk()?);
            count = leading_digits(eight);
        }
        // as many digits as there are, behind zeros: their number is nothing that a processor could guess
        let value = eight_digits(eight << (8 * (7 - count)) << 8);
        digits = digits.checked_mul(POWERS[count])?.checked_add(value)?;
        at += count;
        decimals = at - begin;
        if decimals == 0 {
            return None;
        }
    }
    let bits = rounded(digits, decimals)? | (FIRST as u64) << 63;
    Some(Decimal { value: f64::from_bits(bits), length: at, decimals, digits })
}

/// Bytes that are looked at.
const WINDOW: usize = 40;
/// The digits before the point end before this.
const MOST_WHOLE: usize = 10;
const POWERS: [u64; 8] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000];

/// How many of the eight characters are digits, from the first on.
#[inline(always)]
fn leading_digits(eight: u64) -> usize {
    let digits = eight ^ 0x3030_3030_3030_3030;
    // a byte of more than 9 carries into its high bit
    let other = (digits.wrapping_add(0x7676_7676_7676_7676) | digits) & 0x8080_8080_8080_8080;
    (other.trailing_zeros() / 8) as usize
}

/// The number that eight digits stand for, the first in the lowest byte; zero bytes count as the digit 0 in front.
#[inline(always)]
fn eight_digits(eight: u64) -> u64 {
    let digits = eight & 0x0f0f_0f0f_0f0f_0f0f;
    let pairs = digits.wrapping_mul(10).wrapping_add(digits >> 8);
    let low = (pairs & 0x0000_00ff_0000_00ff).wrapping_mul(0x000f_4240_0000_0064);
    let high = ((pairs >> 16) & 0x0000_00ff_0000_00ff).wrapping_mul(0x0000_2710_0000_0001);
    low.wrapping_add(high) >> 32
}

/// The bits of `digits` / 10^`decimals`, rounded to even.
#[inline(always)]
fn rounded(digits: u64, decimals: usize) -> Option<u64> {
    if digits == 0 {
        return (decimals <= MOST_DECIMALS).then_some(0);
    }
    let reciprocal = RECIPROCALS.get(decimals)?;
    let zeros = digits.leading_zeros();
    let scaled = digits << zeros;
    let product = u128::from(scaled) * u128::from(reciprocal.high);
    let (mut low, mut high) = (product as u64, (product >> 64) as u64);
    if high & 0x1ff == 0x1ff {
        let more = ((u128::from(scaled) * u128::from(reciprocal.low)) >> 64) as u64;
        let (sum, carry) = low.overflowing_add(more);
        low = sum;
        high += u64::from(carry);
    }
    let upper = (high >> 63) as u32;
    let shift = upper + 64 - 52 - 3;
    let mut mantissa = high >> shift;
    // a tie goes to even
    if low <= 1 && decimals <= 4 && mantissa & 3 == 1 && mantissa << shift == high {
        mantissa &= !1;
    }
    mantissa = (mantissa + (mantissa & 1)) >> 1;
    // a mantissa that was rounded up to the next power of two carries into the exponent by itself
    let exponent = (reciprocal.exponent + upper as i32 - zeros as i32) as u64;
    Some((exponent << 52) + mantissa - (1 << 52))
}

/// 10^-k as a fraction of 128 bits and the biased exponent of a number whose digits fill 64 bits.
#[derive(Clone, Copy)]
struct Reciprocal {
    high: u64,
    low: u64,
    exponent: i32,
}

static RECIPROCALS: [Reciprocal; MOST_DECIMALS + 1] = reciprocals();

const fn reciprocals() -> [Reciprocal; MOST_DECIMALS + 1] {
    let mut all = [Reciprocal { high: 1 << 63, low: 0, exponent: 63 + 1023 }; MOST_DECIMALS + 1];
    let mut k = 1;
    while k <= MOST_DECIMALS {
        let power = 5u128.pow(k as u32);
        // 2^(127 + z) / 5^k, rounded up, where 2^z is the next power of two above 5^k: long division, bit by bit
        let z = 128 - power.leading_zeros();
        let (mut quotient, mut rest) = (0u128, 1u128);
        let mut bit = 0;
        while bit < 127 + z {
            rest <<= 1;
            quotient <<= 1;
            if rest >= power {
                rest -= power;
                quotient |= 1;
            }
            bit += 1;
        }
        let rounded = quotient + 1;
        let q = -(k as i32);
        let exponent = (((152_170 + 65_536) * q) >> 16) + 63 + 1023;
        all[k] = Reciprocal { high: (rounded >> 64) as u64, low: rounded as u64, exponent };
        k += 1;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ingest::formats::csv::cell;
    use crate::math::random::Stream;
    use proptest::prelude::*;

    /// As the standard library reads it, or not at all.
    #[track_caller]
    fn check(number: &str) -> bool {
        let text = format!("{number},1.5\n0123456789012345678901234567890123456789");
        match parse(text.as_bytes()) {
            None => false,
            Some(found) => {
                let expected: f64 = number.parse().unwrap();
                assert_eq!((found.value.to_bits(), found.length), (expected.to_bits(), number.len()), "{number}");
                let digits = (found.decimals as i32, found.significant() as i32);
                assert_eq!(digits, cell::digits(number.as_bytes()), "{number}");
                true
            }
        }
    }

    #[test]
    fn usual_numbers_are_read() {
        for number in
            ["0", "-0", "0.0", "-0.0", "7", "-12.5", "0.1", "99999.99", "-0.0009178810869343579", "000.5", "18446744.5"]
        {
            assert!(check(number), "{number}");
        }
        for number in ["9007199254740993", "1.8446744073709551616", "0.0000000000000000000000000001", "1234567890.1"] {
            assert!(!check(number), "{number}");
        }
        for odd in ["", "-", ".5", "5.", "+5", "nan", "-inf", "--5", "- 5", " 5", "x"] {
            let text = format!("{odd},0123456789012345678901234567890123456789");
            assert_eq!(parse(text.as_bytes()), None, "{odd:?}");
        }
        // too near the end to look at as many bytes as there may be
        assert_eq!(parse(b"1.5\n"), None);
    }

    #[test]
    fn ties_and_their_neighbours_go_where_they_belong() {
        let mut draw = Stream::new(11, 0);
        let mut read = 0;
        for _ in 0..200_000 {
            let low = draw.uniform() * 2f64.powi(-((30.0 * draw.uniform()) as i32));
            let middle = low + (f64::from_bits(low.to_bits() + 1) - low) / 2.0;
            let decimals = (25.0 * draw.uniform()) as usize;
            read += usize::from(check(&format!("{low:.decimals$}")) && check(&format!("{middle:.decimals$}")));
        }
        for half in 0..2_000_u64 {
            // 2^53 + 1 and the like lie in the middle of two floats
            for number in [(1 << 53) + 2 * half + 1, (1 << 54) + 4 * half + 2] {
                for decimals in 8..=27 {
                    let text = format!("{number:0>width$}", width = decimals + 1);
                    let (whole, fraction) = text.split_at(text.len() - decimals);
                    read += usize::from(check(&format!("{whole}.{fraction}")));
                }
            }
        }
        assert!(read > 200_000, "{read}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn decimals_are_read_to_the_last_bit(digits: u64, shift in 0..64_u32, decimals in 0..=27_usize, negative: bool) {
            let text = format!("{:0>width$}", digits >> shift, width = decimals + 1);
            let (whole, fraction) = text.split_at(text.len() - decimals);
            let sign = if negative { "-" } else { "" };
            let point = if decimals > 0 { "." } else { "" };
            let read = check(&format!("{sign}{whole}{point}{fraction}"));
            prop_assert!(read || whole.len() > 8);
        }

        #[test]
        fn floats_are_read_as_they_were_written(value: f64, single: f32) {
            for value in [value, f64::from(single)].into_iter().filter(|v| v.is_finite()) {
                check(&format!("{value}"));
                check(&format!("{}", value % 1e4));
            }
        }
    }
}
