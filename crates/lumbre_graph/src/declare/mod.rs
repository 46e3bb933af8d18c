//! Declaring: the graph, its resources and its passes, as data and closures. Nothing here decides anything; that is
//! [`compile`](crate::compile)'s part.

pub(crate) mod graph;
pub(crate) mod kind;
pub(crate) mod pass;
