#include "mech/derivation.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/limits/stack.hpp"
#include "base/text.hpp"
#include "dae/model/equation_lines.hpp"
#include "dae/model/forms.hpp"
#include "expr/graph/depends_on.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "expr/rewrite/tidied.hpp"
#include "mech/lagrangian.hpp"

namespace pendula::mech {
namespace {

using dae::Detail;
using dae::formula;
using dae::ref;
using dae::ref_partial;
using dae::ref_rate_of_partial;
using dae::ref_side;
using dae::shown_from;
using Index = Eigen::Index;

const std::string indent(5, ' ');

/// The terms of a sum, grouped by the factor that depends on the motion: { θ₁″: l₁² m₁ + l₁² m₂ }.
class Collected {
 public:
  explicit Collected(Expr sum) { add(sum, 1); }

  Expr sum() const {
    Expr all = 0;
    for (const auto& [motion, coefficient] : groups_) all = all + simplify(coefficient * motion);
    return all;
  }

 private:
  void add(Expr e, Expr sign) {
    check_stack();
    switch (e.op()) {
      case Op::add:
        add(e.operands()[0], sign);
        return add(e.operands()[1], sign);
      case Op::sub:
        add(e.operands()[0], sign);
        return add(e.operands()[1], -sign);
      case Op::neg:
        return add(e.operands()[0], -sign);
      default: {
        Expr coefficient = sign, motion = 1;
        take_apart(e, coefficient, motion);
        const auto same = [&](const auto& group) { return group.first == motion; };
        const auto it = std::find_if(groups_.begin(), groups_.end(), same);
        if (it == groups_.end())
          groups_.emplace_back(motion, coefficient);
        else
          it->second = it->second + coefficient;
      }
    }
  }

  static void take_apart(Expr e, Expr& coefficient, Expr& motion) {
    check_stack();
    if (e.op() == Op::mul) {
      take_apart(e.operands()[0], coefficient, motion);
      take_apart(e.operands()[1], coefficient, motion);
    } else if (e.op() == Op::div && !varies(e.operands()[1])) {
      take_apart(e.operands()[0], coefficient, motion);
      coefficient = coefficient / e.operands()[1];
    } else if (e.op() == Op::neg) {
      take_apart(e.operands()[0], coefficient, motion);
      coefficient = -coefficient;
    } else {
      Expr& part = varies(e) ? motion : coefficient;
      part = part * e;
    }
  }

  std::vector<std::pair<Expr, Expr>> groups_;
};

/// Writes an expression as a sum with one term per time-dependent factor: M L² θ′ - M L x′ sin θ rather than
/// M L (L θ′ - x′ sin θ), and (m + M) x″ rather than m x″ + M x″.
Expr as_terms(Expr e) {
  constexpr double longest = 200;  // nodes; longer sums are no easier to read when multiplied out
  const Expr simple = simplify(e);
  if (!is_short(simple, longest)) return simple;
  const Expr terms = Collected(expand(simple)).sum();
  return 2 * display_width(to_text(terms)) > 3 * display_width(to_text(simple)) ? simple : terms;
}

/// as_terms() of every entry of a column over the coordinates q; entries that are printed by the names of
/// vectors are only simplified.
VecX as_terms(const VecX& q, const VecX& v) {
  const VecX simple = v.unaryExpr([](Expr e) { return simplify(e); });
  if (q.size() > 1 && dae::rows_per_line(q, simple) > 1) return simple;
  return v.unaryExpr([](Expr e) { return as_terms(e); });
}

VecX gradient_terms(Expr e, const VecX& x) { return as_terms(x, column(gradient(e, entries(x)))); }

/// The energy of positions and angles as textbooks print it, (m₁ + m₂) l₁² θ₁′²/2 + …, where that is at least
/// 10 % shorter.
Expr collected(Expr energy) {
  const Expr simple = as_terms(energy);
  return 10 * display_width(to_text(simple)) < 9 * display_width(to_text(energy)) ? simple : energy;
}

/// Composes the lines of a derivation in order; one method per part.
class Derivation {
 public:
  explicit Derivation(const dae::ModelPtr& model)
      : model_(model),
        mech_(*model->mechanics),
        v_(dot(mech_.q)),
        T_(collected(mech_.T)),
        V_(collected(mech_.V)),
        L_(T_ - V_) {
    for (Index k = 0; k < mech_.C.size(); ++k) L_ -= mech_.multipliers[k] * mech_.C[k];
    lagrange_function();
    energies_alone();
    momenta();
    slopes();
    constraint_jacobian();
    virtual_work();
    equations();
    mass_matrix();
    first_order();
  }

  std::vector<std::string> lines;

 private:
  void add(Detail least, const std::string& line) { lines.push_back(shown_from(least, line)); }

  /// name(q) = value, with the names of vectors where they exist, else one line per coordinate.
  template <class Name>
  void add_column(Detail least, Name name, const VecX& q, const VecX& value) {
    const Index size = dae::rows_per_line(q, value);
    for (Index i = 0; i < q.size(); i += size)
      add(least, indent + formula(name(VecX(q.segment(i, size))), " = ", ref_side(value.segment(i, size))));
  }

  void lagrange_function() {
    add(Detail::full, text("Generalised coordinates  ", coordinates(), ", energies",
                           mech_.C.size() == 0   ? ""
                           : mech_.C.size() == 1 ? " and constraint"
                                                 : " and constraints",
                           ":"));
    energy("T", mech_.T, T_);
    energy("V", mech_.V, V_);
    for (Index k = 0; k < mech_.C.size(); ++k)
      add(Detail::full, indent + formula(mech_.C.size() > 1 ? "C" + subscript(k + 1) : "C", " = ",
                                         ref(mech_.C[k]), " = 0"));
    add(Detail::brief, mech_.C.size() ? "Lagrange function  " + formula("L = T - V - zᵀC") + ":"
                                      : "Lagrange function  " + formula("L = T - V") + ":");
    add(Detail::brief, indent + formula("L = ", ref(L_)));
  }

  void energy(const std::string& name, Expr given, Expr collected) {
    add(Detail::full, indent + formula(name, " = ", ref(given)));
    if (collected != given) add(Detail::full, indent + "  " + formula("= ", ref(collected)));
  }

  void energies_alone() {
    add(Detail::every, "The energies and constraints contribute:");
    add_column(
        Detail::every, [](const VecX& v) { return ref_partial("T", v); }, v_, gradient_terms(mech_.T, v_));
    add_column(
        Detail::every, [](const VecX& q) { return ref_partial("T", q); }, mech_.q,
        gradient_terms(mech_.T, mech_.q));
    add_column(
        Detail::every, [](const VecX& q) { return ref_partial("V", q); }, mech_.q,
        gradient_terms(mech_.V, mech_.q));
    for (Index k = 0; k < mech_.C.size(); ++k) {
      const std::string C = mech_.C.size() > 1 ? "C" + subscript(k + 1) : "C";
      add_column(
          Detail::every, [&](const VecX& q) { return ref_partial(C, q); }, mech_.q,
          gradient_terms(mech_.C[k], mech_.q));
    }
  }

  void momenta() {
    add(Detail::full, "Its partial derivatives:");
    const VecX momentum = gradient_terms(L_, v_);
    add_column(
        Detail::full, [](const VecX& v) { return ref_partial("L", v); }, v_, momentum);
    add_column(
        Detail::full, [](const VecX& v) { return ref_rate_of_partial("L", v); }, v_,
        as_terms(v_, momentum.unaryExpr([](Expr e) { return total_derivative(e); })));
  }

  void slopes() {
    add_column(
        Detail::full, [](const VecX& q) { return ref_partial("L", q); }, mech_.q,
        gradient_terms(L_, mech_.q));
  }

  void constraint_jacobian() {
    if (mech_.C.size() == 0) return;
    add(Detail::full,
        text("The constraint Jacobian", mech_.C.size() > 1 ? ", one row per constraint:" : ":"));
    add(Detail::full,
        indent + formula("∂C/∂q = ", ref(dae::dense(mech_.dCdq, mech_.C.size(), mech_.q.size()))));
  }

  bool has_forces() const {
    return std::any_of(mech_.Q.begin(), mech_.Q.end(), [](Expr e) { return !e.is_zero(); });
  }

  void virtual_work() {
    if (!has_forces()) return add(Detail::full, "No forces besides those of V: " + formula("Q = 0") + ".");
    add(Detail::full, "Generalised forces, from the virtual work  " + formula("δW = Qᵀ δq") + ":");
    for (const auto& [p, F] : mech_.forces) {
      const MatX slope = jacobian(entries(p), entries(mech_.q)).unaryExpr([](Expr e) { return simplify(e); });
      add(Detail::full,
          text(indent, "force ", formula(ref_side(F)), " at ", formula(ref_side(p)), ":  ",
               formula("δW = Fᵀ δp = Fᵀ (∂p/∂q) δq"), ", which adds ",
               formula("(∂p/∂q)ᵀ F = ", ref_side(as_terms(mech_.q, VecX(slope.transpose() * F))))));
      add(Detail::every, indent + formula("∂p/∂q = ", ref(slope)));
    }
    add_column(
        Detail::full, [&](const VecX& q) { return "Q" + coordinate(q); }, mech_.q,
        as_terms(mech_.q, mech_.Q));
  }

  /// "q ∈ ℝ⁶" if q is a column named "q", else "q = (x, θ)".
  std::string coordinates() const {
    const std::string name = vector_to_text(mech_.q);
    return name == "q" ? formula("q ∈ ℝ", superscript(static_cast<long>(mech_.q.size())))
                       : formula("q = ", ref(mech_.q));
  }

  /// "" if q is the column of all coordinates, else "(x)".
  std::string coordinate(const VecX& q) const {
    return q.size() == mech_.q.size() ? std::string() : text("(", ref(q), ")");
  }

  void equations() {
    add(Detail::brief,
        text(formula("d/dt ∂L/∂q′ - ∂L/∂q = Q"), mech_.C.size() ? " and " + formula("C = 0") : "", ":"));
    for (std::size_t b = 0; b < model_->blocks.size(); ++b) {
      const dae::Block& block = model_->blocks[b];
      const Index size = dae::rows_per_line(block.lhs, block.rhs), n = block.lhs.size();
      for (Index i = 0; i < n; i += size) {
        const std::string number = size == 1 ? dae::row_label(block, static_cast<int>(b), static_cast<int>(i))
                                   : i == 0  ? text("(", b + 1, ")")
                                             : "   ";
        add(Detail::brief,
            text("  ", number, number.size() < 4 ? "  " : " ",
                 formula(ref_side(block.lhs.segment(i, size)), " = ", ref_side(block.rhs.segment(i, size)))));
      }
    }
  }

  void mass_matrix() {
    const Index n = mech_.q.size();
    add(Detail::full,
        text("that is  ", formula("W(q) q″", mech_.C.size() ? " + (∂C/∂q)ᵀ z" : "", " = c"), "  with"));
    add(Detail::full, indent + formula("W = ∂²T/∂q′² = ", ref(dae::dense(mech_.M, n, n))));
    add(Detail::full, indent + formula("c = ", ref_side(mech_.rhs)));
  }

  void first_order() {
    const dae::ModelPtr low = dae::to_semi_explicit(model_);
    const bool solved = low->kind == dae::ModelKind::ode || low->kind == dae::ModelKind::semi_explicit;
    add(Detail::full, "As a system of first order, " +
                          formula(mech_.C.size() ? "q′ = v,  v′ = W⁻¹ (c - (∂C/∂q)ᵀ z),  0 = C(q)"
                                                 : "q′ = v,  v′ = W⁻¹ c") +
                          (solved ? ":" : "; in rows, with W on the left:"));
    for (const dae::Block& block : low->blocks) {
      const Index size = dae::rows_per_line(block.lhs, block.rhs);
      for (Index i = 0; i < block.lhs.size(); i += size)
        add(Detail::full, indent + formula(ref_side(block.lhs.segment(i, size)), " = ",
                                           ref_side(block.rhs.segment(i, size))));
    }
  }

  const dae::ModelPtr& model_;
  const dae::Mechanics& mech_;
  VecX v_;
  Expr T_, V_, L_;
};

/// The model returned by lagrange() among this model and its ancestors; null if there is none.
dae::ModelPtr lagrangian_root(dae::ModelPtr m) {
  while (m->parent) m = m->parent;
  return m->mechanics && m->form.empty() ? m : nullptr;
}

}  // namespace

std::vector<std::string> derivation(const dae::ModelPtr& model) {
  PENDULA_ASSERT(model->mechanics.has_value(), "a derivation from the energies needs them");
  return Derivation(model).lines;
}

std::string trace(const dae::ModelPtr& model, dae::Detail detail, dae::Notation notation) {
  const dae::ModelPtr root = lagrangian_root(model);
  const bool from_energies = root && (root == model || detail == Detail::every);
  return (from_energies ? dae::written_out(derivation(root), detail, notation) : "") +
         dae::trace(*model, detail, notation);
}

}  // namespace pendula::mech
