//! Interprets naga's IR over numbers with error bounds. It supports what lighting functions use: no textures and no
//! atomics.

use std::collections::HashMap;

use naga::{
    BinaryOperator, Block, Expression, Function, Handle, Literal, MathFunction, Module, Statement, TypeInner,
    UnaryOperator, valid,
};

use smallvec::{SmallVec, smallvec};

use super::Number;

/// The scalars of a value, which are few and created often.
type Scalars = SmallVec<[Number; 4]>;

/// Largest number of additional paths through the program that are followed where conditions are undecided.
const MAX_WAYS: usize = 64;
/// Largest number of iterations of a loop.
const MAX_ROUNDS: usize = 4096;

/// A compiled kernel whose `evaluate` can be interpreted.
#[derive(Debug)]
pub struct Program {
    module: Module,
    evaluate: Handle<Function>,
    functions: HashMap<Handle<Function>, Frame>,
}

/// The result of interpreting the program for one input.
#[derive(Clone, Debug)]
pub struct Bounds {
    /// Exact results of the program, and how much a device may differ from them.
    pub results: Vec<Number>,
    /// Number of paths followed in addition to the first, due to branches that rounding decides.
    pub open_ways: usize,
    /// Whether rounding decides between two values of a `select`.
    pub open_selects: bool,
}

/// Where the values of a function's expressions and variables are stored.
#[derive(Debug)]
struct Frame {
    expressions: Vec<(usize, usize)>,
    locals: Vec<(usize, usize)>,
    size: usize,
}

enum Flow {
    Next,
    Break,
    Continue,
    Return(Scalars),
}

/// The decisions taken at undecided conditions, in the order in which these are reached.
#[derive(Default)]
struct Ways {
    answers: Vec<bool>,
    met: usize,
    /// Whether a `select` was undecided between values that differ by more than their errors.
    selects: bool,
}

impl Program {
    /// Reads a program in WGSL.
    ///
    /// # Panics
    /// If it is not valid or has no function `evaluate`.
    pub fn new(wgsl: &str) -> Self {
        let module = naga::front::wgsl::parse_str(wgsl).unwrap_or_else(|error| panic!("{error}"));
        let mut validator =
            valid::Validator::new(valid::ValidationFlags::all(), valid::Capabilities::default());
        let info = validator.validate(&module).unwrap_or_else(|error| panic!("{error:?}"));
        let functions = module
            .functions
            .iter()
            .map(|(handle, function)| (handle, Frame::new(&module, function, &info[handle])))
            .collect();
        let evaluate = module
            .functions
            .iter()
            .find(|(_, function)| function.name.as_deref() == Some("evaluate"))
            .map(|(handle, _)| handle);
        Self { evaluate: evaluate.expect("kernels have an evaluate function"), module, functions }
    }

    /// Returns the value of `evaluate` for `x`, with bounds.
    pub fn bounds(&self, x: &[f32]) -> Bounds {
        let arguments: Scalars = x.iter().map(|x| Number::exact((*x).into())).collect();
        let mut ways = Ways::default();
        let mut results = self.call(self.evaluate, std::slice::from_ref(&arguments), &mut ways);
        // All paths that differ from the first in at least one decision.
        let mut pending: Vec<Vec<bool>> = flipped(&ways.answers, 0);
        let (mut open_ways, mut open_selects) = (0, ways.selects);
        while let Some(answers) = pending.pop() {
            open_ways += 1;
            if open_ways > MAX_WAYS {
                results.iter_mut().for_each(|result| result.error = f64::INFINITY);
                break;
            }
            let fixed = answers.len();
            let mut ways = Ways { answers, met: 0, selects: false };
            let other = self.call(self.evaluate, std::slice::from_ref(&arguments), &mut ways);
            pending.extend(flipped(&ways.answers, fixed));
            open_selects |= ways.selects;
            results.iter_mut().zip(other).for_each(|(result, other)| *result = result.hull(other));
        }
        Bounds { results: results.into_vec(), open_ways, open_selects }
    }

    fn call(&self, handle: Handle<Function>, arguments: &[Scalars], ways: &mut Ways) -> Scalars {
        let function = &self.module.functions[handle];
        let frame = &self.functions[&handle];
        let numbers = vec![Number::exact(0.0); frame.size];
        let open = std::cell::Cell::new(false);
        let mut run = Run { program: self, function, frame, numbers, arguments, open };
        for (variable, place) in function.local_variables.iter() {
            if let Some(value) = place.init {
                let value = run.read(value);
                run.numbers[span(frame.locals[variable.index()])].copy_from_slice(&value);
            }
        }
        let flow = run.block(&function.body, ways);
        ways.selects |= run.open.get();
        match flow {
            Flow::Return(result) => result,
            _ => Scalars::new(),
        }
    }
}

/// Returns the prefixes that take the other branch at one of the decisions from `first` on.
fn flipped(answers: &[bool], first: usize) -> Vec<Vec<bool>> {
    (first..answers.len()).map(|at| answers[..at].iter().copied().chain([!answers[at]]).collect()).collect()
}

fn span((start, length): (usize, usize)) -> std::ops::Range<usize> {
    start..start + length
}

impl Frame {
    fn new(module: &Module, function: &Function, info: &valid::FunctionInfo) -> Self {
        let mut size = 0;
        let mut place = |inner: &TypeInner| {
            let length = scalars(module, inner);
            size += length;
            (size - length, length)
        };
        let expressions = function
            .expressions
            .iter()
            .map(|(handle, _)| place(info[handle].ty.inner_with(&module.types)))
            .collect();
        let locals =
            function.local_variables.iter().map(|(_, local)| place(&module.types[local.ty].inner)).collect();
        Self { expressions, locals, size }
    }
}

/// Returns the number of scalars in a type.
fn scalars(module: &Module, inner: &TypeInner) -> usize {
    match inner {
        TypeInner::Scalar(_) => 1,
        TypeInner::Vector { size, .. } => *size as usize,
        TypeInner::Array { base, size: naga::ArraySize::Constant(count), .. } => {
            count.get() as usize * scalars(module, &module.types[*base].inner)
        }
        TypeInner::Struct { members, .. } => {
            members.iter().map(|member| scalars(module, &module.types[member.ty].inner)).sum()
        }
        _ => 0,
    }
}

struct Run<'a> {
    program: &'a Program,
    function: &'a Function,
    frame: &'a Frame,
    numbers: Vec<Number>,
    arguments: &'a [Scalars],
    /// Whether the errors left the condition of a `select` undecided.
    open: std::cell::Cell<bool>,
}

impl Run<'_> {
    fn block(&mut self, block: &Block, ways: &mut Ways) -> Flow {
        for statement in block.iter() {
            match statement {
                Statement::Emit(range) => {
                    for handle in range.clone() {
                        let value = self.compute(handle);
                        self.keep(handle, &value);
                    }
                }
                Statement::Block(inner) => match self.block(inner, ways) {
                    Flow::Next => {}
                    flow => return flow,
                },
                Statement::If { condition, accept, reject } => {
                    let condition = self.read(*condition)[0];
                    let taken = if ways.decide(condition) { accept } else { reject };
                    match self.block(taken, ways) {
                        Flow::Next => {}
                        flow => return flow,
                    }
                }
                Statement::Loop { body, continuing, break_if } => {
                    for round in 0.. {
                        assert!(round < MAX_ROUNDS, "a loop does not end");
                        match self.block(body, ways) {
                            Flow::Break => break,
                            Flow::Return(value) => return Flow::Return(value),
                            Flow::Next | Flow::Continue => {}
                        }
                        self.block(continuing, ways);
                        if break_if.is_some_and(|condition| {
                            let condition = self.read(condition)[0];
                            ways.decide(condition)
                        }) {
                            break;
                        }
                    }
                }
                Statement::Break => return Flow::Break,
                Statement::Continue => return Flow::Continue,
                Statement::Return { value } => {
                    return Flow::Return(value.map_or_else(Scalars::new, |value| self.read(value)));
                }
                Statement::Store { pointer, value } => {
                    let value = self.read(*value);
                    let place = self.pointer(*pointer);
                    self.numbers[span(place)].copy_from_slice(&value);
                }
                Statement::Call { function, arguments, result } => {
                    let arguments: SmallVec<[Scalars; 6]> =
                        arguments.iter().map(|argument| self.read(*argument)).collect();
                    let value = self.program.call(*function, &arguments, ways);
                    if let Some(result) = result {
                        self.keep(*result, &value);
                    }
                }
                other => panic!("lighting functions have no {other:?}"),
            }
        }
        Flow::Next
    }

    fn keep(&mut self, handle: Handle<Expression>, value: &[Number]) {
        let place = span(self.frame.expressions[handle.index()]);
        if place.len() == value.len() {
            self.numbers[place].copy_from_slice(value);
        }
    }

    /// Returns the value of an expression: computed if it needs no emission, otherwise as stored.
    fn read(&self, handle: Handle<Expression>) -> Scalars {
        match self.function.expressions[handle] {
            Expression::Literal(_)
            | Expression::Constant(_)
            | Expression::ZeroValue(_)
            | Expression::FunctionArgument(_) => self.compute(handle),
            _ => SmallVec::from_slice(&self.numbers[span(self.frame.expressions[handle.index()])]),
        }
    }

    /// Returns the storage of a variable or of a part of one.
    fn pointer(&self, handle: Handle<Expression>) -> (usize, usize) {
        match &self.function.expressions[handle] {
            Expression::LocalVariable(local) => self.frame.locals[local.index()],
            Expression::AccessIndex { base, index } => {
                let (start, _) = self.pointer(*base);
                let (offset, length) = self.part(self.pointed_type(*base), *index as usize);
                (start + offset, length)
            }
            Expression::Access { base, index } => {
                let (start, _) = self.pointer(*base);
                let index = self.read(*index)[0].value as usize;
                let (offset, length) = self.part(self.pointed_type(*base), index);
                (start + offset, length)
            }
            other => panic!("lighting functions have no pointer {other:?}"),
        }
    }

    fn pointed_type(&self, handle: Handle<Expression>) -> &TypeInner {
        let types = &self.program.module.types;
        match &self.function.expressions[handle] {
            Expression::LocalVariable(local) => &types[self.function.local_variables[*local].ty].inner,
            Expression::AccessIndex { base, index } => match self.pointed_type(*base) {
                TypeInner::Struct { members, .. } => &types[members[*index as usize].ty].inner,
                TypeInner::Array { base, .. } => &types[*base].inner,
                other => panic!("no part of {other:?} has parts"),
            },
            Expression::Access { base, .. } => match self.pointed_type(*base) {
                TypeInner::Array { base, .. } => &types[*base].inner,
                other => panic!("no part of {other:?} has parts"),
            },
            other => panic!("lighting functions have no pointer {other:?}"),
        }
    }

    /// Returns offset and length, in scalars, of a part of a composite.
    fn part(&self, inner: &TypeInner, index: usize) -> (usize, usize) {
        let module = &self.program.module;
        match inner {
            TypeInner::Vector { .. } => (index, 1),
            TypeInner::Array { base, .. } => {
                let length = scalars(module, &module.types[*base].inner);
                (index * length, length)
            }
            TypeInner::Struct { members, .. } => {
                let length = |at: usize| scalars(module, &module.types[members[at].ty].inner);
                ((0..index).map(length).sum(), length(index))
            }
            other => panic!("no part {index} of {other:?}"),
        }
    }

    /// Returns the type of a composite value, as far as accesses need it.
    fn value_type(&self, handle: Handle<Expression>) -> &TypeInner {
        let module = &self.program.module;
        match &self.function.expressions[handle] {
            Expression::FunctionArgument(index) => {
                &module.types[self.function.arguments[*index as usize].ty].inner
            }
            Expression::Compose { ty, .. } | Expression::ZeroValue(ty) => &module.types[*ty].inner,
            Expression::CallResult(function) => match &module.functions[*function].result {
                Some(result) => &module.types[result.ty].inner,
                None => panic!("a call without a result has no parts"),
            },
            Expression::Load { pointer } => self.pointed_type(*pointer),
            Expression::AccessIndex { base, index } => match self.value_type(*base) {
                TypeInner::Struct { members, .. } => &module.types[members[*index as usize].ty].inner,
                TypeInner::Array { base, .. } => &module.types[*base].inner,
                other => other,
            },
            // Everything else is a vector, whose parts are single numbers.
            _ => &TypeInner::Vector { size: naga::VectorSize::Quad, scalar: naga::Scalar::F32 },
        }
    }

    fn compute(&self, handle: Handle<Expression>) -> Scalars {
        let module = &self.program.module;
        match &self.function.expressions[handle] {
            Expression::Literal(literal) => smallvec![number(literal)],
            Expression::Constant(constant) => global(module, module.constants[*constant].init),
            Expression::ZeroValue(ty) => {
                smallvec![Number::exact(0.0); scalars(module, &module.types[*ty].inner)]
            }
            Expression::Compose { components, .. } => {
                components.iter().flat_map(|component| self.read(*component)).collect()
            }
            Expression::FunctionArgument(index) => self.arguments[*index as usize].clone(),
            Expression::AccessIndex { base, index } => {
                if matches!(self.function.expressions[*base], Expression::LocalVariable(_)) {
                    return Scalars::new();
                }
                let value = self.read(*base);
                let (offset, length) = self.part(self.value_type(*base), *index as usize);
                value.get(offset..offset + length).map_or_else(Scalars::new, SmallVec::from_slice)
            }
            Expression::Access { .. } | Expression::LocalVariable(_) => Scalars::new(),
            Expression::Load { pointer } => SmallVec::from_slice(&self.numbers[span(self.pointer(*pointer))]),
            Expression::Splat { size, value } => smallvec![self.read(*value)[0]; *size as usize],
            Expression::Swizzle { size, vector, pattern } => {
                let vector = self.read(*vector);
                pattern[..*size as usize].iter().map(|component| vector[*component as usize]).collect()
            }
            Expression::Unary { op, expr } => {
                let unary = |x: Number| match op {
                    UnaryOperator::Negate => x.negate(),
                    UnaryOperator::LogicalNot => Number::boolean(!x.is_true(), x.is_open()),
                    UnaryOperator::BitwiseNot => panic!("lighting functions have no bits"),
                };
                self.read(*expr).into_iter().map(unary).collect()
            }
            Expression::Binary { op, left, right } => {
                broadcast(&self.read(*left), &self.read(*right), |a, b| binary(*op, a, b))
            }
            Expression::Select { condition, accept, reject } => {
                let (condition, accept) = (self.read(*condition), self.read(*accept));
                let reject = self.read(*reject);
                (0..accept.len())
                    .map(|at| {
                        let condition = condition[at.min(condition.len() - 1)];
                        let (taken, other) = match condition.is_true() {
                            true => (accept[at], reject[at]),
                            false => (reject[at], accept[at]),
                        };
                        if !condition.is_open() {
                            return taken;
                        }
                        let hull = taken.hull(other);
                        let apart = hull.error > 2.0 * taken.error.max(other.error);
                        self.open.set(self.open.get() || apart);
                        hull
                    })
                    .collect()
            }
            Expression::Math { fun, arg, arg1, arg2, .. } => {
                let argument = |handle: &Option<Handle<Expression>>| handle.map(|handle| self.read(handle));
                let (b, c) = (argument(arg1).unwrap_or_default(), argument(arg2).unwrap_or_default());
                math(*fun, &self.read(*arg), &b, &c)
            }
            Expression::As { expr, .. } => self.read(*expr),
            other => panic!("lighting functions have no {other:?}"),
        }
    }
}

impl Ways {
    fn decide(&mut self, condition: Number) -> bool {
        if !condition.is_open() {
            return condition.is_true();
        }
        if self.met == self.answers.len() {
            self.answers.push(condition.is_true());
        }
        self.met += 1;
        self.answers[self.met - 1]
    }
}

fn number(literal: &Literal) -> Number {
    match *literal {
        Literal::F32(value) => Number::constant(value),
        Literal::U32(value) => Number::exact(value.into()),
        Literal::I32(value) => Number::exact(value.into()),
        Literal::Bool(value) => Number::boolean(value, false),
        ref other => panic!("lighting functions have no {other:?}"),
    }
}

fn global(module: &Module, handle: Handle<Expression>) -> Scalars {
    match &module.global_expressions[handle] {
        Expression::Literal(literal) => smallvec![number(literal)],
        Expression::Constant(constant) => global(module, module.constants[*constant].init),
        Expression::Compose { components, .. } => {
            components.iter().flat_map(|component| global(module, *component)).collect()
        }
        Expression::Splat { size, value } => smallvec![global(module, *value)[0]; *size as usize],
        Expression::ZeroValue(ty) => smallvec![Number::exact(0.0); scalars(module, &module.types[*ty].inner)],
        other => panic!("constants have no {other:?}"),
    }
}

fn broadcast(a: &[Number], b: &[Number], operation: impl Fn(Number, Number) -> Number) -> Scalars {
    let length = a.len().max(b.len());
    (0..length).map(|at| operation(a[at.min(a.len() - 1)], b[at.min(b.len() - 1)])).collect()
}

fn binary(operator: BinaryOperator, a: Number, b: Number) -> Number {
    match operator {
        BinaryOperator::Add => a.add(b),
        BinaryOperator::Subtract => a.subtract(b),
        BinaryOperator::Multiply => a.multiply(b),
        BinaryOperator::Divide => a.divide(b),
        BinaryOperator::Less => a.less(b, false),
        BinaryOperator::LessEqual => a.less(b, true),
        BinaryOperator::Greater => b.less(a, false),
        BinaryOperator::GreaterEqual => b.less(a, true),
        BinaryOperator::Equal => a.equal(b),
        BinaryOperator::NotEqual => {
            let same = a.equal(b);
            Number::boolean(!same.is_true(), same.is_open())
        }
        BinaryOperator::LogicalAnd | BinaryOperator::And => {
            let certainly_false = |x: Number| !x.is_true() && !x.is_open();
            let open = (a.is_open() || b.is_open()) && !certainly_false(a) && !certainly_false(b);
            Number::boolean(a.is_true() && b.is_true(), open)
        }
        BinaryOperator::LogicalOr | BinaryOperator::InclusiveOr => {
            let certainly_true = |x: Number| x.is_true() && !x.is_open();
            let open = (a.is_open() || b.is_open()) && !certainly_true(a) && !certainly_true(b);
            Number::boolean(a.is_true() || b.is_true(), open)
        }
        other => panic!("lighting functions have no {other:?}"),
    }
}

fn math(function: MathFunction, a: &[Number], b: &[Number], c: &[Number]) -> Scalars {
    let each = |operation: &dyn Fn(Number) -> Number| a.iter().map(|x| operation(*x)).collect::<Scalars>();
    let (zero, one) = (Number::exact(0.0), Number::exact(1.0));
    match function {
        MathFunction::Abs => each(&Number::abs),
        MathFunction::Min => broadcast(a, b, Number::minimum),
        MathFunction::Max => broadcast(a, b, Number::maximum),
        MathFunction::Clamp => broadcast(&broadcast(a, b, Number::maximum), c, Number::minimum),
        MathFunction::Saturate => each(&|x| x.maximum(zero).minimum(one)),
        MathFunction::Dot => smallvec![Number::dot(a, b)],
        MathFunction::Length => smallvec![Number::dot(a, a).square_root()],
        MathFunction::Cross => [(1, 2), (2, 0), (0, 1)]
            .map(|(i, j)| a[i].multiply(b[j]).subtract(a[j].multiply(b[i])))
            .into_iter()
            .collect(),
        MathFunction::Sqrt => each(&Number::square_root),
        MathFunction::InverseSqrt => each(&Number::inverse_square_root),
        MathFunction::Exp => each(&Number::exponential),
        MathFunction::Exp2 => each(&Number::exponential_2),
        MathFunction::Log2 => each(&Number::logarithm_2),
        MathFunction::Pow => broadcast(a, b, Number::power),
        MathFunction::Atan2 => broadcast(a, b, Number::arc_tangent_2),
        MathFunction::Mix => {
            // Devices compute either x (1 - t) + y t or x + t (y - x), which differ in what they round.
            let rest = broadcast(c, &[one], |t, one| one.subtract(t));
            let of_both = broadcast(
                &broadcast(a, &rest, Number::multiply),
                &broadcast(b, c, Number::multiply),
                Number::add,
            );
            let change = broadcast(c, &broadcast(b, a, Number::subtract), Number::multiply);
            let from_first = broadcast(a, &change, Number::add);
            broadcast(&of_both, &from_first, |one, other| Number { error: one.error.max(other.error), ..one })
        }
        other => panic!("lighting functions have no {other:?}"),
    }
}
