//! Operations on numbers and vectors. An operation whose result is known to the bit for all operands is not recorded.

use super::graph::{Binary, Graph, Node, Op, Unary};
use super::kind::Kind;

impl Graph {
    /// A constant. WGSL cannot express infinity, so the largest float replaces it; NaN is made from its bits.
    pub(super) fn float(&mut self, value: f32) -> Node {
        if value.is_nan() {
            let bits = self.uint(value.to_bits());
            return self.float_of_bits(bits);
        }
        self.record(Op::Float(value.clamp(f32::MIN, f32::MAX).to_bits()), Kind::Float)
    }
    pub(super) fn uint(&mut self, value: u32) -> Node {
        self.record(Op::Uint(value), Kind::Uint)
    }
    pub(super) fn mask(&mut self, value: bool) -> Node {
        self.record(Op::Mask(value), Kind::Mask)
    }
    fn float_of(&self, node: Node) -> Option<f32> {
        if let Op::Float(bits) = *self.op(node) { Some(f32::from_bits(bits)) } else { None }
    }
    fn uint_of(&self, node: Node) -> Option<u32> {
        if let Op::Uint(value) = *self.op(node) { Some(value) } else { None }
    }
    /// A constant mask.
    pub(super) fn mask_of(&self, node: Node) -> Option<bool> {
        if let Op::Mask(value) = *self.op(node) { Some(value) } else { None }
    }

    pub(super) fn call(&mut self, function: &str, arguments: Vec<Node>, kind: Kind) -> Node {
        self.record(Op::Call(function.into(), arguments), kind)
    }

    pub(super) fn negate(&mut self, a: Node) -> Node {
        if let Some(value) = self.float_of(a) {
            return self.float(-value);
        }
        if let Op::Unary(Unary::Negate, a) = *self.op(a) {
            return a;
        }
        self.record(Op::Unary(Unary::Negate, a), self.kind(a))
    }

    pub(super) fn not(&mut self, a: Node) -> Node {
        if let Some(value) = self.mask_of(a) {
            return self.mask(!value);
        }
        if let Op::Unary(Unary::Not, a) = *self.op(a) {
            return a;
        }
        self.record(Op::Unary(Unary::Not, a), Kind::Mask)
    }

    /// The operand of a negation, if the value is one.
    fn negated(&mut self, a: Node) -> Option<Node> {
        match *self.op(a) {
            Op::Unary(Unary::Negate, of) => Some(of),
            Op::Float(bits) if f32::from_bits(bits) < 0.0 => Some(self.float(-f32::from_bits(bits))),
            Op::Binary(op @ (Binary::Multiply | Binary::Divide), [a, b]) => match *self.op(a) {
                Op::Unary(Unary::Negate, a) => Some(self.arithmetic(op, a, b)),
                _ => None,
            },
            _ => None,
        }
    }

    /// Arithmetic on floats and vectors. The second operand may be a scalar that scales a vector.
    pub(super) fn arithmetic(&mut self, op: Binary, a: Node, b: Node) -> Node {
        let (x, y) = (self.float_of(a), self.float_of(b));
        if let (Some(x), Some(y)) = (x, y) {
            return self.float(match op {
                Binary::Add => x + y,
                Binary::Subtract => x - y,
                Binary::Multiply => x * y,
                Binary::Divide => x / y,
                _ => unreachable!("no such operation on floats gives one"),
            });
        }
        let is_one = |x: Option<f32>| x == Some(1.0);
        // Adding a negated value equals subtraction, to the bit.
        match (op, self.negated(a), self.negated(b)) {
            (Binary::Add, _, Some(b)) => return self.arithmetic(Binary::Subtract, a, b),
            (Binary::Add, Some(a), None) => return self.arithmetic(Binary::Subtract, b, a),
            (Binary::Subtract, _, Some(b)) => return self.arithmetic(Binary::Add, a, b),
            _ => {}
        }
        match op {
            Binary::Multiply | Binary::Divide if is_one(y) => a,
            Binary::Multiply if is_one(x) => b,
            _ => self.record(Op::Binary(op, [a, b]), self.kind(a)),
        }
    }

    /// Operations on integers.
    pub(super) fn integers(&mut self, op: Binary, a: Node, b: Node) -> Node {
        let (x, y) = (self.uint_of(a), self.uint_of(b));
        if let (Some(x), Some(y)) = (x, y) {
            return self.uint(match op {
                Binary::Add => x.wrapping_add(y),
                Binary::Multiply => x.wrapping_mul(y),
                Binary::And => x & y,
                Binary::Or => x | y,
                Binary::Xor => x ^ y,
                Binary::ShiftLeft => x << y,
                Binary::ShiftRight => x >> y,
                _ => unreachable!("no such operation on integers gives one"),
            });
        }
        match (op, x, y) {
            (Binary::Add | Binary::Or | Binary::Xor, _, Some(0))
            | (Binary::ShiftLeft | Binary::ShiftRight, _, Some(0))
            | (Binary::Multiply, _, Some(1))
            | (Binary::And, _, Some(u32::MAX)) => a,
            (Binary::Add | Binary::Or | Binary::Xor, Some(0), _)
            | (Binary::Multiply, Some(1), _)
            | (Binary::And, Some(u32::MAX), _) => b,
            (Binary::Multiply | Binary::And, _, Some(0)) => b,
            (Binary::Multiply | Binary::And, Some(0), _) => a,
            _ => self.record(Op::Binary(op, [a, b]), Kind::Uint),
        }
    }

    /// Conjunction or disjunction.
    pub(super) fn masks(&mut self, op: Binary, a: Node, b: Node) -> Node {
        // The absorbing and the neutral value.
        let decides = op == Binary::Or;
        match (self.mask_of(a), self.mask_of(b)) {
            (Some(x), _) => {
                if x == decides {
                    a
                } else {
                    b
                }
            }
            (_, Some(y)) => {
                if y == decides {
                    b
                } else {
                    a
                }
            }
            _ if a == b => a,
            _ => self.record(Op::Binary(op, [a, b]), Kind::Mask),
        }
    }

    pub(super) fn compare(&mut self, op: Binary, a: Node, b: Node) -> Node {
        let known = match (self.float_of(a), self.float_of(b), self.uint_of(a), self.uint_of(b)) {
            (Some(x), Some(y), ..) => match op {
                Binary::Less => Some(x < y),
                Binary::LessOrEqual => Some(x <= y),
                Binary::Greater => Some(x > y),
                Binary::GreaterOrEqual => Some(x >= y),
                _ => None,
            },
            (_, _, Some(x), Some(y)) => match op {
                Binary::Equal => Some(x == y),
                Binary::Less => Some(x < y),
                _ => None,
            },
            _ => None,
        };
        let is_literal = |node| self.float_of(node).is_some() || self.uint_of(node).is_some();
        let flipped = match op {
            Binary::Less => Binary::Greater,
            Binary::LessOrEqual => Binary::GreaterOrEqual,
            Binary::Greater => Binary::Less,
            Binary::GreaterOrEqual => Binary::LessOrEqual,
            _ => op,
        };
        match known {
            Some(value) => self.mask(value),
            // Literals read better on the right.
            None if is_literal(a) => self.record(Op::Binary(flipped, [b, a]), Kind::Mask),
            None => self.record(Op::Binary(op, [a, b]), Kind::Mask),
        }
    }

    /// `a` where the mask holds, otherwise `b`.
    pub(super) fn select(&mut self, mask: Node, a: Node, b: Node) -> Node {
        match self.mask_of(mask) {
            Some(true) => a,
            Some(false) => b,
            None if a == b => a,
            None => {
                let kind = self.kind(a);
                self.call("select", vec![b, a, mask], kind)
            }
        }
    }

    pub(super) fn bits_of(&mut self, a: Node) -> Node {
        match self.op(a) {
            &Op::Float(bits) => self.uint(bits),
            Op::Call(name, of) if **name == *"bitcast<f32>" => of[0],
            _ => self.call("bitcast<u32>", vec![a], Kind::Uint),
        }
    }
    pub(super) fn float_of_bits(&mut self, a: Node) -> Node {
        match self.op(a) {
            &Op::Uint(bits) if f32::from_bits(bits).is_finite() => self.float(f32::from_bits(bits)),
            // WGSL rejects constants that are not finite: zero is added in a form that no compiler can fold.
            Op::Uint(_) => {
                let zero = self.record(Op::Given("scene.zero".into()), Kind::Uint);
                let bits = self.record(Op::Binary(Binary::Or, [a, zero]), Kind::Uint);
                self.call("bitcast<f32>", vec![bits], Kind::Float)
            }
            Op::Call(name, of) if **name == *"bitcast<u32>" => of[0],
            _ => self.call("bitcast<f32>", vec![a], Kind::Float),
        }
    }

    /// A function of one float, evaluated if the operand is constant and the result is exact.
    pub(super) fn function_of_float(&mut self, function: &str, a: Node, exact: fn(f32) -> f32) -> Node {
        match self.float_of(a) {
            Some(value) => self.float(exact(value)),
            None => self.call(function, vec![a], Kind::Float),
        }
    }
    /// The same for two operands.
    pub(super) fn function_of_floats(
        &mut self,
        function: &str,
        [a, b]: [Node; 2],
        exact: fn(f32, f32) -> f32,
    ) -> Node {
        match (self.float_of(a), self.float_of(b)) {
            (Some(a), Some(b)) => self.float(exact(a, b)),
            _ => self.call(function, vec![a, b], Kind::Float),
        }
    }

    pub(super) fn float_of_uint(&mut self, a: Node) -> Node {
        match self.uint_of(a) {
            Some(value) => self.float(value as f32),
            None => self.call("f32", vec![a], Kind::Float),
        }
    }
    /// Rounds towards zero.
    pub(super) fn uint_of_float(&mut self, a: Node) -> Node {
        match self.float_of(a) {
            Some(value) => self.uint(value as u32),
            None => self.call("u32", vec![a], Kind::Uint),
        }
    }
    pub(super) fn reverse_bits(&mut self, a: Node) -> Node {
        match self.uint_of(a) {
            Some(value) => self.uint(value.reverse_bits()),
            None => self.call("reverseBits", vec![a], Kind::Uint),
        }
    }
}
