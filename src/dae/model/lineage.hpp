// Helpers for model transformations: fresh names, groups of unknowns, attributes inherited from the parent.
#pragma once

#include <string>
#include <unordered_set>
#include <vector>

#include "dae/model/make_model.hpp"
#include "dae/model/model.hpp"

namespace pendula::dae {

/// Names of all symbols a model uses, so that new ones do not collide.
std::unordered_set<std::string> used_names(const Model& m);
/// `preferred` if it is free, else `fallback` with as many _ as needed.
std::string fresh_name(const std::unordered_set<std::string>& used, const std::string& preferred,
                       const std::string& fallback);

/// The unknowns of a model grouped as the user declared them: a column, or single variables.
struct Group {
  std::string name;
  std::vector<Expr> leaves;
  int order;
};
std::vector<Group> groups(const Model& m);
/// New variables of the same shape as a group: a column of its size, or a scalar.
std::vector<Expr> new_variable_like(const Group& g, const std::string& name);
/// n new variables of this name, or of this name with _: a scalar if n = 1, else a column.
std::vector<Expr> new_variables(const Model& m, const std::string& name, std::size_t n);

VecX mapped(const VecX& v, const Substitution& s);

/// Everything but equations and trace.
ModelOptions child_of(const ModelPtr& m);
/// Rewrites invariants, relations and projections in the child's unknowns.
void move_invariants(ModelOptions& options, const Substitution& s);
/// x, z and u as in m.
void declare_unknowns(ModelOptions& options, const Model& m);

/// A constraint with its derivatives, of a model and the form "acc" made of it.
struct Chain {
  std::vector<Constraint> below;  ///< C, C′ …: what the form no longer imposes
  std::size_t block;
  Eigen::Index row;
  Expr last;  ///< the derivative that took its place
};
std::vector<Chain> chains(const Model& model, const Model& low);

/// The model that a reduced form was made from, with the form's parameter values;
/// the model itself if it is none.
ModelPtr original(const ModelPtr& m);

/// An expression in symbols of this model or of its lineage, rewritten in unknowns
/// of this model (q.dot -> v).
Expr resolve(const Model& model, Expr e);

/// "C₁′ = 0"; a condition that is an equation of the model by its number: "(5)′".
std::string condition_text(const Constraint& c);

/// "x, y, q": names for messages, columns by their entries.
std::string names_of(const std::vector<Expr>& list);
/// The same with whole columns by their names: "q, x".
std::string grouped_names(const std::vector<Expr>& list);
/// A column as text, a single entry without parentheses.
std::string column_text(const VecX& v);

}  // namespace pendula::dae
