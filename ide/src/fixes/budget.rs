//! The bound on the work for fixes. Texts may be damaged or hostile: each of a thousand findings has several fixes, and each fix is
//! tried by a check of the whole text.

/// Most findings of a text that get fixes at once.
pub const FINDINGS: usize = 100;
/// Most texts that are checked.
pub const TRIALS: usize = 200;
/// Text that may be checked for all fixes together, in bytes.
const BYTES: usize = 2_000_000;
/// Text whose syntax may be read to find the places of lost signs, in bytes.
const SYNTAX: usize = 24_000_000;
/// The message of an error takes the time in which this many bytes are checked.
const ERROR: usize = 200;

/// The work that is left for fixes. One budget serves all rounds of a repair.
#[derive(Clone, Debug)]
pub struct Budget {
    trials: usize,
    bytes: usize,
    syntax: usize,
    ended: bool,
}

/// Work that was kept for later.
#[derive(Debug)]
pub struct Aside {
    trials: usize,
    bytes: usize,
}

impl Default for Budget {
    fn default() -> Self {
        Self { trials: TRIALS, bytes: BYTES, syntax: SYNTAX, ended: false }
    }
}

impl Budget {
    /// A sentence for people if findings got no fixes, or not all of their fixes.
    pub fn note(&self) -> Option<String> {
        let sentence = format!(
            "not all fixes were tried: a run looks at {FINDINGS} findings and tries {TRIALS} fixes, fewer in a long text; \
             mend some errors and run it again"
        );
        self.ended.then_some(sentence)
    }

    /// The number of texts that were checked.
    pub fn tried(&self) -> usize {
        TRIALS - self.trials
    }

    /// Takes the check of a text with a number of errors. Returns false if too little is left.
    pub(super) fn check(&mut self, len: usize, errors: usize) -> bool {
        let enough = self.trials > 0 && take(&mut self.bytes, len + ERROR * errors);
        self.trials -= usize::from(enough);
        self.ended |= !enough;
        enough
    }

    /// Takes the search for the fixes of a finding. Returns false if too little is left.
    pub(super) fn search(&mut self, len: usize) -> bool {
        let enough = self.trials > 0 && take(&mut self.bytes, len / 4 * 3);
        self.ended |= !enough;
        enough
    }

    /// Takes the reading of the syntax of a text. Returns false if too little is left.
    pub(super) fn parse(&mut self, len: usize) -> bool {
        let enough = take(&mut self.syntax, len);
        self.ended |= !enough;
        enough
    }

    /// Keeps a quarter of the work for later, at least the check of a text with a number of errors if there is as much.
    pub fn set_aside(&mut self, len: usize, errors: usize) -> Aside {
        let bytes = (self.bytes / 4).max(len + ERROR * errors).min(self.bytes);
        let aside = Aside { trials: self.trials / 4, bytes };
        self.trials -= aside.trials;
        self.bytes -= aside.bytes;
        aside
    }

    /// Allows the work that was kept.
    pub fn give_back(&mut self, aside: Aside) {
        self.trials += aside.trials;
        self.bytes += aside.bytes;
    }

    /// The number of texts of this length whose syntax may be read for one finding: a quarter of the rest, so that later findings have a
    /// share.
    pub(super) fn places(&self, len: usize) -> usize {
        self.syntax / 4 / len.max(1)
    }

    /// Notes that findings were left out.
    pub(super) fn end(&mut self) {
        self.ended = true;
    }
}

/// Takes work from an amount. If too little is left, nothing is: a shorter text is no reason to go on.
fn take(left: &mut usize, work: usize) -> bool {
    let enough = work <= *left;
    *left = if enough { *left - work } else { 0 };
    enough
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_after_trials_or_bytes() {
        let mut budget = Budget::default();
        assert!((0..TRIALS).all(|_| budget.check(100, 1)) && budget.note().is_none());
        assert!(!budget.check(100, 1) && !budget.search(100) && budget.note().is_some());
        assert_eq!(budget.tried(), TRIALS);
        let mut budget = Budget::default();
        assert!(budget.check(BYTES / 2, 0) && !budget.check(BYTES / 2 + 1, 0) && !budget.check(1, 0));
        assert_eq!((budget.tried(), budget.note().is_some()), (1, true));
        let mut budget = Budget::default();
        assert!(budget.check(10, BYTES / ERROR / 2) && !budget.check(10, BYTES / ERROR));
        let mut budget = Budget::default();
        assert_eq!(budget.places(SYNTAX / 8), 2);
        assert!(budget.parse(SYNTAX) && budget.note().is_none() && !budget.parse(1) && budget.check(1, 0));
        assert_eq!(budget.places(1), 0);
    }
}
