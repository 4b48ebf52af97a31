//! What a report says, in words and tables: for terminals and pages alike.

pub(crate) mod answer;
mod beside;
mod columns;
mod drift;
mod laid;
mod map_check;
mod ordered_pair;
pub(crate) mod promise;
mod standing;
mod suite_words;
pub(crate) mod warnings;

pub use answer::answer;
pub use beside::{BesideColumn, beside, places};
pub(crate) use columns::more_is_better;
pub use columns::{Ranking, RankingRow, ScoreColumn, legend, ranking};
pub(crate) use drift::metres_between;
pub(crate) use drift::which_way;
pub use drift::{
    DRIFT_HEADS, drift_beside_scores, drift_compared, drift_in_words, drift_row, metres, pairs_in_words,
    worse_between, worse_by,
};
pub use laid::laid_onto;
pub(crate) use laid::rigid;
pub use map_check::{map_check, not_in_a_cloud};
pub use ordered_pair::{OrderedPair, every_pair, main_pairs};
pub use promise::promise;
pub use standing::{Mood, Standing, standing};
pub use suite_words::{OrderedVersions, log_word, ordered_versions, p_value, suite_answer, suite_promise};
pub use warnings::warnings;
