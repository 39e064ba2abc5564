// How an equation between columns is set: as one vector equation where the names of vectors suffice, as one
// for every point of a system of points, else row by row.
#pragma once

#include "dae/model/derivation_markup.hpp"
#include "dae/model/model.hpp"

namespace pendula::dae {

/// Of n rows, how many make one line: n, n/k where each of the k parts reads as a vector equation, or 1. The
/// names are those of the moment of printing.
Eigen::Index rows_per_line(const VecX& lhs, const VecX& rhs);

/// A column by names; one with a single entry as a multiple of a unit vector: -m g e₃.
std::string side(const VecX& v, Notation notation = Notation::text);

struct EquationLines {
  struct Sides {
    std::string left, right;
  };
  std::vector<Sides> sides;
  bool rows = false;  ///< one line per row: (3a), (3b) …
};

/// The lines of an equation, at most `most` where it is set row by row; rows that were rewritten stand alone.
EquationLines equation_lines(const Block& b, Eigen::Index most, Notation notation = Notation::text);

}  // namespace pendula::dae
