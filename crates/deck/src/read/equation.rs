//! Linear equations.

use slipstick_meshio::abaqus::Card;

use super::{DAMAGED, Reader, Target};

/// An equation of `*EQUATION`: Σ factor · displacement = 0.
#[derive(Debug)]
pub struct Equation {
    pub terms: Vec<EquationTerm>,
    /// Whether the components are global ones, whatever the axes of the nodes.
    pub global: bool,
    /// Of the keyword and of its first line of data.
    pub lines: [usize; 2],
}

/// A term: a node or a set, a component from 0, and a factor.
#[derive(Debug)]
pub struct EquationTerm {
    pub target: Target,
    pub component: u8,
    pub factor: f64,
}

impl Reader<'_> {
    pub(super) fn equations(&mut self, card: &Card<'_>) {
        self.allow(card, &[]);
        let line = card.keyword.line;
        self.ledger.translated("EQUATION", line, "`[[equation]]`");
        // the number of terms that are missing, and the terms
        let mut open: Option<(usize, Equation)> = None;
        for (data, fields) in card.data() {
            let fields: Vec<&str> = fields.into_iter().filter(|field| !field.is_empty()).collect();
            let Some((missing, equation)) = &mut open else {
                match fields
                    .first()
                    .and_then(|field| field.parse::<usize>().ok())
                    .filter(|&n| n > 0 && fields.len() == 1)
                {
                    Some(count) => {
                        open = Some((count, Equation { terms: Vec::new(), global: false, lines: [line, data] }))
                    }
                    None => {
                        let why = "an equation begins with a line that has the number of its terms";
                        return self.ledger.wrong("EQUATION", [line, data], why, DAMAGED);
                    }
                }
                continue;
            };
            let mut terms = Vec::new();
            for term in fields.chunks(3) {
                let number =
                    |at: usize| term.get(at).and_then(|field| field.replace(['d', 'D'], "e").parse::<f64>().ok());
                let component = number(1).filter(|c| [1.0, 2.0, 3.0].contains(c));
                match (component, number(2).filter(|factor| factor.is_finite())) {
                    (Some(component), Some(factor)) => {
                        terms.push(EquationTerm {
                            target: Target::new(term[0]),
                            component: component as u8 - 1,
                            factor,
                        });
                    }
                    _ => {
                        let why = "a term has a node or a set, a component from 1 to 3, and a factor";
                        return self.ledger.wrong("EQUATION", [line, data], why, DAMAGED);
                    }
                }
            }
            if terms.len() > *missing {
                let why = "the equation has more terms than it announces";
                return self.ledger.wrong("EQUATION", [line, data], why, DAMAGED);
            }
            *missing -= terms.len();
            equation.terms.extend(terms.into_iter().filter(|term| term.factor != 0.0));
            if *missing == 0 {
                self.deck.equations.extend(open.take().map(|(_, equation)| equation));
            }
        }
        if open.is_some() {
            self.ledger.wrong("EQUATION", [line; 2], "the last equation has fewer terms than it announces", DAMAGED);
        }
    }
}
