//! The nodes of the pack keep the rules of all nodes.
use std::sync::Arc;

#[test]
fn nodes_of_the_pack_keep_the_contract() {
    let registry = Arc::new(shibo_example_pack::registry());
    assert_eq!(shibo_contract::complaints(&registry, shibo_example_pack::family().name), Vec::<String>::new());
}
