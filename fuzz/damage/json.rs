//! Damage to JSON that stays JSON: other types, missing and doubled keys, depth, length.

use serde_json::{Value, json};

use super::Random;

/// Values of every type, each in JSON without a blank.
const VALUES: &str = r#"null true 0 -1 1e308 -0.0 18446744073709551615 -9223372036854775808 0.5 "" "nan" [] {} [null] [[],{}]
    [1,2,3] "2147483648" 4294967296 "\u001b[2J\n\u202e""#;

/// Damages what parses as JSON; false where it does not.
pub(super) fn damage(text: &mut Vec<u8>, random: &mut Random) -> bool {
    let Ok(mut whole) = serde_json::from_slice::<Value>(text) else { return false };
    if random.once_in(12) {
        // Deeper than any stack, or as deep as readers allow.
        let depth = *random.pick(&[100, 127, 128, 10_000, 1_000_000]);
        let (open, close) = *random.pick(&[("[", "]"), ("{\"a\":", "}")]);
        *text = format!("{}1{}", open.repeat(depth), close.repeat(depth)).into_bytes();
        return true;
    }
    let at = random.below(count(&whole));
    if let Some(node) = nth(&mut whole, &mut { at }) {
        change(node, random);
    }
    let Ok(changed) = serde_json::to_vec_pretty(&whole) else { return false };
    *text = changed;
    true
}

fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(values) => values.iter().map(count).sum(),
        Value::Object(fields) => fields.values().map(count).sum(),
        _ => 0,
    }
}

/// The value that is `left` values further on, depth first.
fn nth<'a>(value: &'a mut Value, left: &mut usize) -> Option<&'a mut Value> {
    if *left == 0 {
        return Some(value);
    }
    *left -= 1;
    match value {
        Value::Array(values) => values.iter_mut().find_map(|value| nth(value, left)),
        Value::Object(fields) => fields.values_mut().find_map(|value| nth(value, left)),
        _ => None,
    }
}

fn change(node: &mut Value, random: &mut Random) {
    match (random.below(4), &mut *node) {
        (0 | 1, Value::Object(fields)) => {
            let Some(key) = fields.keys().nth(random.below(fields.len())).cloned() else { return };
            if let (Some(value), true) = (fields.remove(&key), random.once_in(2)) {
                fields.insert(random.pick(&["", "runs", "name", "a\u{202e}b"]).to_string(), value);
            }
        }
        (0 | 1, Value::Array(values)) if random.once_in(2) => {
            super::damage_parts(values, |value| value.to_string().len(), random);
        }
        (0, Value::Number(number)) => {
            let float = number.as_f64().unwrap_or(0.0);
            *node = json!(float * random.pick(&[-1.0, 0.5, 2.0, 1e9, 1e-9, 1e300]));
        }
        (1, Value::String(_)) => *node = json!("a".repeat(70_000)),
        _ => *node = serde_json::from_str(random.word(VALUES)).unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_reached_and_the_result_is_json() {
        let mut value = json!({"a": [1, 2], "b": {"c": 3}});
        assert_eq!(count(&value), 6);
        assert!((0..6).all(|at| nth(&mut value, &mut { at }).is_some()));
        assert!(VALUES.split_whitespace().all(|word| serde_json::from_str::<Value>(word).is_ok()));
        let mut random = Random::of(&[3]);
        for _ in 0..300 {
            assert!(damage(&mut value.to_string().into_bytes(), &mut random));
        }
        assert!(!damage(&mut b"{".to_vec(), &mut random));
    }
}
