#include "dae/alias/eliminate.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/alias/affine_row.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/truncated_text.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

constexpr int most_fill = 4;           // new terms by one elimination, beyond those of an alias
constexpr std::size_t short_row = 12;  // all its unknowns are looked at again when it changes

struct Definition {
  int unknown;
  Expr meaning;  ///< in unknowns of which some may be eliminated later
};

/// In how many rows every unknown occurs, and where.
class Occurrences {
 public:
  Occurrences(const UnknownNumbers& numbers, const std::vector<AffineRow>& rows)
      : numbers_(numbers),
        where_(static_cast<std::size_t>(numbers.size())),
        count_(where_.size(), 0),
        inside_(where_.size(), 0) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      enter(rows[i], 1);
      note(rows[i], static_cast<int>(i));
    }
  }

  /// Counts the unknowns of a row in (1) or out (-1).
  void enter(const AffineRow& row, int sign) {
    for (const AffineRow::Term& t : row.terms) count_[t.unknown] += sign;
    for (int u : row.inside) {
      if (!row.find(u)) count_[u] += sign;
      inside_[u] += sign;
    }
  }
  /// Row i contains these unknowns.
  void note(const AffineRow& row, int i) {
    for (const AffineRow::Term& t : row.terms) where_[t.unknown].push_back(i);
    for (int u : row.inside) where_[u].push_back(i);
  }

  int count(int unknown) const { return count_[unknown]; }
  int inside(int unknown) const { return inside_[unknown]; }
  /// Rows that may contain the unknown; some no longer do, some stand there twice.
  const std::vector<int>& where(int unknown) const { return where_[unknown]; }
  std::vector<int> take(int unknown) { return std::exchange(where_[unknown], {}); }

  /// The highest derivative of the unknown that occurs.
  int highest(int base) const {
    int k = numbers_.stride() - 1;
    while (k > 0 && count_[base + k] == 0) --k;
    return k;
  }
  bool is_top(int unknown) const {
    return numbers_.order(unknown) > 0 && numbers_.order(unknown) == highest(numbers_.base(unknown));
  }

 private:
  const UnknownNumbers& numbers_;
  std::vector<std::vector<int>> where_;
  std::vector<int> count_, inside_;  ///< rows with each unknown; rows with it in their rest
};

bool is_nonzero_product(const Model& model, Expr c) {
  if (c.is_constant()) return constant_value(c) != 0;
  if (c.is_symbol()) {
    if (symbol_of(c).kind == Kind::constant) return true;
    const auto value = model.values.find(c);
    if (symbol_of(c).kind != Kind::parameter || value == model.values.end()) return false;
    return value->second.is_constant() && constant_value(value->second) != 0;
  }
  const auto nonzero = [&](int i) { return is_nonzero_product(model, c.operand(i)); };
  switch (c.op()) {
    case Op::neg:
    case Op::sqrt:
      return nonzero(0);
    case Op::mul:
    case Op::div:
      return nonzero(0) && nonzero(1);
    case Op::pow:
      return nonzero(0) && c.operand(1).is_constant();
    default:
      return false;
  }
}

bool is_constant_coefficient(Expr c) {
  for (Expr leaf : leaves({&c, 1}))
    if (symbol_of(leaf).kind != Kind::parameter && symbol_of(leaf).kind != Kind::constant) return false;
  return true;
}

/// A sum of parameters that is not 0 at their values, nor what is left of larger terms.
bool is_nonzero_sum(const Model& model, Expr c) {
  constexpr double cancelled = 1e-3;
  if ((c.op() != Op::add && c.op() != Op::sub) || !is_constant_coefficient(c)) return false;
  std::unordered_map<Expr, double> values;
  for (Expr leaf : leaves({&c, 1})) {
    const auto value = model.values.find(leaf);
    if (symbol_of(leaf).kind == Kind::constant) continue;
    if (value == model.values.end() || !value->second.is_constant()) return false;
    values[leaf] = constant_value(value->second);
  }
  const Expr all[] = {c, c.operand(0), c.operand(1)};
  const std::vector<double> v = evaluate(all, values);
  return std::fabs(v[0]) > cancelled * (std::fabs(v[1]) + std::fabs(v[2]));
}

/// 0: ±1, 1: another number, 2: a product of parameters, 3: a sum of such; nothing else divides.
std::optional<int> pivot_class(const Model& model, Expr c) {
  if (c.is_one() || c == Expr(-1)) return 0;
  if (c.is_constant()) return constant_value(c) != 0 ? std::optional(1) : std::nullopt;
  if (is_nonzero_product(model, c)) return 2;
  return is_nonzero_sum(model, c) ? std::optional(3) : std::nullopt;
}

/// The row as an expression.
Expr written(const AffineRow& e, const UnknownNumbers& numbers) {
  Expr sum = e.rest;
  for (const AffineRow::Term& t : e.terms) {
    const Expr leaf = numbers.leaf(t.unknown);
    const bool minus = t.coefficient.op() == Op::neg || t.coefficient == Expr(-1);
    sum = minus ? sum - scaled(-t.coefficient, leaf) : sum + scaled(t.coefficient, leaf);
  }
  return sum;
}

/// Equations and unknowns during elimination.
class Elimination {
 public:
  explicit Elimination(const Model& model)
      : model_(model),
        numbers_(model),
        rows_(affine_rows(model, numbers_)),
        alive_(rows_.size(), 1),
        changed_(rows_.size(), 0),
        occurrences_(numbers_, rows_),
        wanted_(static_cast<std::size_t>(numbers_.size()), 0),
        guarded_(static_cast<std::size_t>(numbers_.size()), 0),
        seen_(rows_.size(), 0) {
    for (const auto* declared : {&model.start_values, &model.start_guesses})
      for (const auto& [leaf, value] : *declared)
        if (const int u = numbers_.of(symbol_of(leaf).base); u >= 0)
          wanted_[u] = static_cast<char>(declared == &model.start_guesses ? 2 : 1);
    for (const Transition& event : model.events)
      for (const auto& [state, value] : event.reset)
        if (const int u = numbers_.of(symbol_of(state).base); u >= 0) guarded_[u] = 1;
  }

  void run() {
    for (std::size_t i = 0; i < rows_.size(); ++i) consider_row(static_cast<int>(i));
    std::size_t left = rows_.size();
    while (!queue_.empty() && left > 1) {
      const Candidate c = queue_.top();
      queue_.pop();
      const auto now = candidate(c.row, c.unknown);
      if (!now) continue;
      if (now->cost > c.cost) {
        queue_.push(*now);
        continue;
      }
      eliminate(c.row, c.unknown);
      --left;
    }
  }

  const std::vector<AffineRow>& rows() const { return rows_; }
  const UnknownNumbers& numbers() const { return numbers_; }
  bool alive(std::size_t row) const { return alive_[row]; }
  bool changed(std::size_t row) const { return changed_[row]; }
  const std::vector<Definition>& definitions() const { return definitions_; }

 private:
  struct Candidate {
    long cost;
    int depth, row, unknown;
    bool operator<(const Candidate& other) const {  // the queue's top is the largest
      return std::tuple(-cost, depth, -row, unknown) <
             std::tuple(-other.cost, other.depth, -other.row, other.unknown);
    }
  };

  /// May a differentiated x be replaced? Derivatives that come in through its definition must not outnumber
  /// those of x that go: how many do, or nothing.
  std::optional<int> raised_orders(const AffineRow& row, int x, int times) const {
    int raised = 0;
    const auto enter = [&](int u) {
      const int more = std::max(0, numbers_.order(u) + times - occurrences_.highest(numbers_.base(u)));
      raised += more;
      // x = y′ does not make one equation of two, x = z no state of an algebraic unknown
      const bool coordinate = occurrences_.highest(numbers_.base(u)) > 0 && !occurrences_.is_top(u);
      if (more > 0 && !coordinate) return false;
      return raised <= times && numbers_.order(u) + times < numbers_.stride();
    };
    if (!std::all_of(row.inside.begin(), row.inside.end(), enter)) return {};
    for (const AffineRow::Term& t : row.terms) {
      if (t.unknown == x) continue;
      if (!enter(t.unknown) || !is_constant_coefficient(t.coefficient)) return {};
    }
    return raised;
  }

  /// What has a guess is better seen by Newton's method, unless states give its value.
  bool follows_from_states(const AffineRow& row, int x) const {
    const auto is_state = [&](int u) {
      return u == x || occurrences_.highest(numbers_.base(u)) > numbers_.order(u);
    };
    return std::all_of(row.inside.begin(), row.inside.end(), is_state) &&
           std::all_of(row.terms.begin(), row.terms.end(),
                       [&](const auto& t) { return is_state(t.unknown); });
  }

  /// A state that events reset may only be replaced by another state.
  bool loses_reset(const AffineRow& row, int x) const {
    if (!guarded_[x]) return false;
    if (row.terms.size() != 2 || !row.inside.empty() || !row.rest.is_zero()) return true;
    const AffineRow::Term& a = row.terms[0];
    const AffineRow::Term& b = row.terms[1];
    if (!(a.coefficient + b.coefficient).is_zero()) return true;
    const int other = a.unknown == x ? b.unknown : a.unknown;
    return occurrences_.highest(numbers_.base(other)) <= numbers_.order(other);
  }

  std::optional<Candidate> candidate(int row, int x) const {
    if (!alive_[row] || numbers_.order(x) != 0) return {};
    const AffineRow& r = rows_[row];
    const AffineRow::Term* term = r.find(x);
    if (!term || r.has_inside(x)) return {};
    const auto pivot = pivot_class(model_, term->coefficient);
    if (!pivot) return {};
    long others = -1;  // rows that x is written into
    int nonlinear = 0;
    for (int k = 0; k < numbers_.stride(); ++k) {
      others += occurrences_.count(x + k);
      nonlinear += occurrences_.inside(x + k);
      if (k > 0 && (r.find(x + k) || r.has_inside(x + k))) return {};
    }
    const int times = occurrences_.highest(x);
    const std::optional<int> raised = times > 0 ? raised_orders(r, x, times) : 0;
    if (!raised) return {};
    if (loses_reset(r, x)) return {};
    const long terms = static_cast<long>(r.terms.size() - 1 + r.inside.size());
    const long fill = std::max(0L, others - 1) * std::max(0L, terms - 1);
    if (fill > most_fill) return {};
    const auto top = [&](int u) { return occurrences_.is_top(u); };
    const bool derivatives = std::any_of(r.terms.begin(), r.terms.end(),
                                         [&](const auto& t) { return occurrences_.is_top(t.unknown); }) ||
                             std::any_of(r.inside.begin(), r.inside.end(), top);
    if (derivatives && times == 0 && (others > 1 || nonlinear > 0)) return {};
    if (wanted_[x] == 2 && terms > 1 && !follows_from_states(r, x)) return {};
    const bool buries = nonlinear > 0 && terms > 1;  // a variable that Newton's method had better see
    const long cost = 16 * fill + 64 * buries + 4 * *pivot + 32 * derivatives + 2 * terms +
                      3 * (wanted_[x] > 0) + 8 * *raised;
    const std::string& name = symbol_of(numbers_.leaf(x)).name;
    return Candidate{cost, static_cast<int>(std::count(name.begin(), name.end(), '.')), row, x};
  }

  void consider(int row, int unknown) {
    const int x = numbers_.base(unknown);
    if (const auto c = candidate(row, x)) queue_.push(*c);
  }
  void consider_row(int row) {
    for (const AffineRow::Term& t : rows_[row].terms) consider(row, t.unknown);
  }

  /// x = … as a row, from row `row`, which is used up by it.
  AffineRow defined(int row, int x) const {
    const AffineRow& r = rows_[row];
    const Expr c = r.find(x)->coefficient;
    AffineRow e;
    for (const AffineRow::Term& t : r.terms)
      if (t.unknown != x) e.terms.push_back({t.unknown, divided(-t.coefficient, c)});
    e.rest = divided(-r.rest, c);
    e.inside = r.inside;
    if (e.inside.empty()) e.rest = substitute(e.rest, known_);
    return e;
  }

  /// Without eliminated unknowns.
  Expr in_remaining(Expr e) const {
    for (;;) {
      const Expr next = substitute(e, meanings_);
      if (next == e) return e;
      e = next;
    }
  }

  AffineRow derivative(const AffineRow& e) const {
    AffineRow d;
    for (const AffineRow::Term& t : e.terms) d.terms.push_back({t.unknown + 1, t.coefficient});
    d.rest = total_derivative(in_remaining(e.rest));
    for (Expr leaf : leaves({&d.rest, 1}))
      if (const int u = numbers_.of(leaf); u >= 0) d.put_inside(u);
    return d;
  }

  void eliminate(int row, int x) {
    const int times = occurrences_.highest(x);
    AffineRow e = defined(row, x);
    occurrences_.enter(rows_[row], -1);
    alive_[row] = 0;
    const std::vector<AffineRow::Term> freed = rows_[row].terms;
    for (int k = 0; k <= times; ++k) {
      if (k > 0) e = derivative(e);
      const Expr meaning = written(e, numbers_);
      definitions_.push_back({x + k, meaning});
      meanings_[numbers_.leaf(x + k)] = meaning;
      if (e.terms.empty() && e.inside.empty()) known_[numbers_.leaf(x + k)] = meaning;
      pass_guard(x + k, e);
      write_into_others(x + k, e);
    }
    for (const AffineRow::Term& t : freed) reconsider(t.unknown);
    for (const AffineRow::Term& t : e.terms) reconsider(t.unknown);
  }

  void pass_guard(int x, const AffineRow& e) {
    if (guarded_[x] && !e.terms.empty()) guarded_[numbers_.base(e.terms[0].unknown)] = 1;
  }

  void write_into_others(int x, const AffineRow& e) {
    ++stamp_;
    for (int i : occurrences_.take(x)) {
      if (!alive_[i] || seen_[i] == stamp_) continue;
      seen_[i] = stamp_;
      AffineRow& r = rows_[i];
      const AffineRow::Term* term = r.find(x);
      const bool inside = r.has_inside(x);
      if (!term && !inside) continue;
      occurrences_.enter(r, -1);
      if (term) {
        const Expr factor = term->coefficient;
        r.terms.erase(r.terms.begin() + (term - r.terms.data()));
        r.add(e, factor);
      }
      if (inside) {
        r.take_inside(x);
        for (const AffineRow::Term& t : e.terms) r.put_inside(t.unknown);
        for (int u : e.inside) r.put_inside(u);
      }
      occurrences_.enter(r, 1);
      changed_[i] = 1;
      occurrences_.note(e, i);
      if (r.terms.size() <= short_row)
        consider_row(i);
      else
        for (const AffineRow::Term& t : e.terms) consider(i, t.unknown);
    }
  }

  /// What occurs in fewer rows now may have become cheap.
  void reconsider(int unknown) {
    const int x = numbers_.base(unknown);
    if (occurrences_.count(x) == 0 || occurrences_.count(x) > 3) return;
    const std::vector<int> rows = occurrences_.where(x);
    if (rows.size() > short_row) return;
    for (int i : rows)
      if (alive_[i]) consider(i, x);
  }

  const Model& model_;
  UnknownNumbers numbers_;
  std::vector<AffineRow> rows_;
  std::vector<char> alive_, changed_;
  Occurrences occurrences_;
  std::vector<char> wanted_;   ///< 1: has a value at the start, 2: a guess
  std::vector<char> guarded_;  ///< reset by an event
  std::vector<int> seen_;
  int stamp_ = 0;
  std::priority_queue<Candidate> queue_;
  std::vector<Definition> definitions_;
  Substitution meanings_;  ///< the same as definitions_
  Substitution known_;     ///< eliminated, and without unknowns
};

/// What every eliminated unknown means in those that are left. A definition may contain unknowns that were
/// eliminated before or after it: what it needs comes first.
Substitution relations_of(const Elimination& e) {
  std::unordered_map<Expr, Expr> meanings;
  for (const Definition& d : e.definitions()) meanings[e.numbers().leaf(d.unknown)] = d.meaning;
  Substitution relations;
  std::vector<std::pair<Expr, bool>> todo;  // a leaf, and whether what it needs has been seen to
  for (auto it = e.definitions().rbegin(); it != e.definitions().rend(); ++it)
    todo.emplace_back(e.numbers().leaf(it->unknown), false);
  while (!todo.empty()) {
    auto& [leaf, ready] = todo.back();
    const Expr here = leaf, meaning = meanings.at(leaf);
    if (relations.count(here) != 0) {
      todo.pop_back();
    } else if (ready) {
      todo.pop_back();
      relations[here] = substitute(meaning, relations);
    } else {
      ready = true;
      for (Expr inside : leaves({&meaning, 1}))
        if (meanings.count(inside) != 0 && relations.count(inside) == 0) todo.emplace_back(inside, false);
    }
  }
  return relations;
}

/// top derivatives = the rest, or 0 = …
Block written_row(const AffineRow& row, const Elimination& e, const Substitution& relations) {
  const UnknownNumbers& numbers = e.numbers();
  std::vector<AffineRow::Term> terms = row.terms;
  std::stable_sort(terms.begin(), terms.end(), [&](const auto& a, const auto& b) {
    return numbers.order(a.unknown) > numbers.order(b.unknown);
  });
  const int top = terms.empty() ? 0 : numbers.order(terms[0].unknown);
  const Expr rest = substitute(row.rest, relations);
  const bool turn =
      !terms.empty() && (terms[0].coefficient.op() == Op::neg ||
                         (terms[0].coefficient.is_constant() && constant_value(terms[0].coefficient) < 0));
  Expr left = 0, right = turn ? rest : -rest;
  for (const AffineRow::Term& t : terms) {
    const Expr c = turn ? -t.coefficient : t.coefficient, leaf = numbers.leaf(t.unknown);
    if (top > 0 && numbers.order(t.unknown) == top)
      left += scaled(c, leaf);
    else if (c.op() == Op::neg || c == Expr(-1) || (c.is_constant() && constant_value(c) < 0))
      right += scaled(-c, leaf);
    else
      right -= scaled(c, leaf);
  }
  Block block;
  block.lhs = VecX::Constant(1, left);
  block.rhs = VecX::Constant(1, right);
  return block;
}

[[noreturn]] void refuse_row(const Model& m, std::size_t i, Expr value) {
  const std::string note = m.blocks[m.origin[i].first].note;
  throw Error(
      text("equation ", m.label(i), note.empty() ? "" : " (" + note + ")", ", ", m.equation_text(i), ", ",
           value.is_zero() ? "follows from the others: it says nothing new, and some unknown has no equation"
                           : text("contradicts the others: with them it reads 0 = ", truncated_text(value))));
}

std::vector<Block> remaining_blocks(const Model& m, const Elimination& e, const Substitution& relations) {
  std::vector<Block> blocks;
  for (std::size_t i = 0; i < e.rows().size(); ++i) {
    if (!e.alive(i)) continue;
    const auto [block, row] = m.origin[i];
    const Block& source = m.blocks[block];
    const AffineRow& r = e.rows()[i];
    Block made;
    if (e.changed(i)) {
      made = written_row(r, e, relations);
      if (r.terms.empty() && r.inside.empty()) refuse_row(m, i, made.rhs[0]);
    } else {
      made.lhs = VecX::Constant(1, source.lhs[row]);
      made.rhs = VecX::Constant(1, source.rhs[row]);
    }
    made.note = !source.note.empty() ? source.note : "from " + m.label(i);
    blocks.push_back(std::move(made));
  }
  return blocks;
}

}  // namespace

ModelPtr eliminate(const ModelPtr& model) {
  Elimination e(*model);
  e.run();
  if (e.definitions().empty()) return model;
  const Substitution relations = relations_of(e);
  ModelOptions options = child_of(model);
  options.form.clear();
  options.mechanics.reset();
  move_invariants(options, relations);
  constexpr std::size_t most_lines = 500;
  std::size_t count = 0;
  for (const Definition& d : e.definitions()) {
    const Expr leaf = e.numbers().leaf(d.unknown);
    if (e.numbers().order(d.unknown) == 0 && ++count <= most_lines)
      options.trace.push_back(text("eliminated:  ", to_text(leaf), " = ", truncated_text(d.meaning)));
  }
  if (count > most_lines) options.trace.push_back(text("… ", count, " unknowns eliminated in all"));
  for (const auto& [leaf, meaning] : relations) options.relations[leaf] = meaning;
  return make_model(remaining_blocks(*model, e, relations), options);
}

}  // namespace pendula::dae
