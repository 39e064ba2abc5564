// The order in which symbols were declared, and numbers that depend on a symbol's name alone.
//
// Ids of leaves follow the first use of a name in the process. What people read and what is drawn at random
// must not: a script gives the same answer in a fresh session and after others. Terms and factors are ordered
// by the first declaration in the session (var, vars, param …), so that declaring a symbol again moves
// nothing; a model lists its unknowns by their latest declaration, so that a part of a script lists them as
// it declares them, whatever was declared before; random values of a symbol come from its name.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula {

/// A symbol that did not exist before; its place holds until it is declared.
void newly_made(Expr symbol);
/// The symbols, declared in this order; returns them.
std::vector<Expr> newly_declared(std::vector<Expr> symbols);
/// A derivative that a form made an unknown, under a name like x_dot: the user may have
/// declared one of that name, too.
Expr newly_declared_by_form(Expr unknown);
/// An unknown that takes the place of a derivative: it is printed like the derivative it stands for, unless
/// the user declared a symbol of its name.
Expr declared_for(Expr derivative, Expr unknown);
/// The derivative that an unknown was made for.
std::optional<Expr> stands_for(Expr unknown);
/// A new session begins: what was declared before it does not count.
void begin_declarations();
/// A number that differs between sessions with declarations in them.
std::uint64_t session_of_declarations();

/// Place of a leaf in the order of first declarations; a derivative stands where its base does.
std::uint64_t declaration_of(Expr leaf);

/// The same for the latest declarations.
std::uint64_t latest_declaration_of(Expr leaf);

/// By order of derivative, then by first declaration: x, y, x′, y′, x″.
void sort_by_declaration(std::vector<Expr>& leaves);
/// By latest declaration. Requires leaves of order 0.
void sort_by_latest_declaration(std::vector<Expr>& leaves);

/// A hash of kind, name and order of a symbol, or of the name of an unspecified
/// function and its partial derivatives.
std::uint64_t name_hash(Expr leaf);

}  // namespace pendula
