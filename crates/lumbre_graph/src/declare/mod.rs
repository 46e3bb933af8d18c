//! Declaring the graph, its resources and its passes, as data and closures. All decisions are made in
//! [`compile`](crate::compile).

pub(crate) mod graph;
pub(crate) mod kind;
pub(crate) mod pass;
