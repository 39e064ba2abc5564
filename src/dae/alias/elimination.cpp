#include "dae/alias/elimination.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "dae/alias/pivot.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/graph/depends_on.hpp"

namespace pendula::dae {

constexpr int most_fill = 4;           // terms added by one elimination, beyond those of an alias
constexpr std::size_t short_row = 12;  // all its unknowns are considered again when it changes

/// The row as an expression.
static Expr written(const AffineRow& e, const UnknownNumbers& numbers) {
  Expr sum = e.rest;
  for (const AffineRow::Term& t : e.terms) {
    const Expr leaf = numbers.leaf(t.unknown);
    const bool minus = t.coefficient.op() == Op::neg || t.coefficient == Expr(-1);
    sum = minus ? sum - scaled(-t.coefficient, leaf) : sum + scaled(t.coefficient, leaf);
  }
  return sum;
}
Elimination::Elimination(const Model& model)
    : model_(model),
      numbers_(model),
      rows_(affine_rows(model, numbers_)),
      active_(rows_.size(), 1),
      changed_(rows_.size(), 0),
      occurrences_(numbers_, rows_),
      wanted_(static_cast<std::size_t>(numbers_.size()), 0),
      guarded_(static_cast<std::size_t>(numbers_.size()), 0),
      seen_(rows_.size(), 0) {
  for (const auto* declared : {&model.start_values, &model.start_guesses})
    for (const auto& [leaf, value] : *declared)
      if (const auto u = numbers_.of(symbol_of(leaf).base))
        wanted_[*u] = static_cast<char>(declared == &model.start_guesses ? 2 : 1);
  for (const Transition& event : model.events)
    for (const auto& [state, value] : event.reset)
      if (const auto u = numbers_.of(symbol_of(state).base)) guarded_[*u] = 1;
}

void Elimination::run() {
  std::size_t left = rows_.size(), before = 0;
  do {  // again while rows are eliminated: a former top derivative may be a state now, whose forces can go
    before = left;
    for (std::size_t i = 0; i < rows_.size(); ++i)
      if (active_[i]) consider_row(static_cast<int>(i));
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
  } while (left < before);
}

std::optional<int> Elimination::raised_orders(const AffineRow& row, int x, int times) const {
  int raised = 0;
  const auto enter = [&](int u) {
    const int more = std::max(0, numbers_.order(u) + times - occurrences_.highest(numbers_.base(u)));
    raised += more;
    // reject x = y′, which would not merge equations, and x = z, which would make an algebraic
    // unknown a state
    const bool coordinate = occurrences_.highest(numbers_.base(u)) > 0 && !occurrences_.is_top(u);
    if (more > 0 && !coordinate) return false;
    return raised <= times && numbers_.order(u) + times < numbers_.stride();
  };
  if (!std::all_of(row.inside.begin(), row.inside.end(), enter)) return {};
  for (const AffineRow::Term& t : row.terms) {
    if (t.unknown == x) continue;
    if (!enter(t.unknown) || varies(t.coefficient)) return {};
  }
  return raised;
}

bool Elimination::follows_from_states(const AffineRow& row, int x) const {
  const auto is_state = [&](int u) {
    return u == x || occurrences_.highest(numbers_.base(u)) > numbers_.order(u);
  };
  return std::all_of(row.inside.begin(), row.inside.end(), is_state) &&
         std::all_of(row.terms.begin(), row.terms.end(), [&](const auto& t) { return is_state(t.unknown); });
}

bool Elimination::loses_reset(const AffineRow& row, int x) const {
  if (!guarded_[x]) return false;
  if (row.terms.size() != 2 || !row.inside.empty() || !row.rest.is_zero()) return true;
  const AffineRow::Term& a = row.terms[0];
  const AffineRow::Term& b = row.terms[1];
  if (!(a.coefficient + b.coefficient).is_zero()) return true;
  const int other = a.unknown == x ? b.unknown : a.unknown;
  return occurrences_.highest(numbers_.base(other)) <= numbers_.order(other);
}

std::optional<Elimination::Candidate> Elimination::candidate(int row, int x) const {
  if (!active_[row] || numbers_.order(x) != 0) return {};
  const AffineRow& r = rows_[row];
  const AffineRow::Term* term = r.find(x);
  if (!term || r.has_inside(x)) return {};
  const auto pivot = pivot_class(model_, term->coefficient);
  if (!pivot) return {};
  long others = -1;  // rows into which x is substituted
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
  if (derivatives && times == 0 && (others > 2 || nonlinear > 0)) return {};
  if (wanted_[x] == 2 && terms > 1 && !follows_from_states(r, x)) return {};
  // x = c·y is preferred: a position equals another one rather than a difference of two
  const bool sum = terms > 1;
  // hides a variable that Newton's method should see; unknowns determined by states need no iteration
  const bool hides_nonlinearity = nonlinear > 0 && sum && !follows_from_states(r, x);
  // (u - v)/R substituted into two sums adds large, rounded terms to both, and their own small terms are lost
  const bool rounds = *pivot > 1 && others > 1;
  // x″ = y″ - z″ in place of x″ couples the accelerations; prefer to eliminate a distance, not a position
  const auto accelerates = [&](int u) {
    return u != x && numbers_.order(u) + times >= occurrences_.highest(numbers_.base(u));
  };
  const bool couples = times > 0 && sum && std::any_of(r.terms.begin(), r.terms.end(), [&](const auto& t) {
                         return accelerates(t.unknown);
                       });
  // unknowns used nowhere else go first, however long their row, like the ground current of a large circuit
  const long written_terms = others > 0 ? terms : std::min(terms, 1L);
  const long cost = 16 * fill + 64 * hides_nonlinearity + (sum ? 8 + 4 * *pivot : *pivot) + 80 * rounds +
                    32 * (couples || derivatives) + 256 * (derivatives && others > 1) + 2 * written_terms +
                    3 * (wanted_[x] > 0) + 8 * *raised;
  const std::string& name = symbol_of(numbers_.leaf(x)).name;
  return Candidate{cost, static_cast<int>(std::count(name.begin(), name.end(), '.')), row, x};
}

void Elimination::consider(int row, int unknown) {
  const int x = numbers_.base(unknown);
  if (const auto c = candidate(row, x)) queue_.push(*c);
}
void Elimination::consider_row(int row) {
  for (const AffineRow::Term& t : rows_[row].terms) consider(row, t.unknown);
}

AffineRow Elimination::defined(int row, int x) const {
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

Expr Elimination::in_remaining(Expr e) const {
  for (;;) {
    const Expr next = substitute(e, meanings_);
    if (next == e) return e;
    e = next;
  }
}

AffineRow Elimination::derivative(const AffineRow& e) const {
  AffineRow d;
  for (const AffineRow::Term& t : e.terms) d.terms.push_back({t.unknown + 1, t.coefficient});
  d.rest = total_derivative(in_remaining(e.rest));
  for (Expr leaf : leaves({&d.rest, 1}))
    if (const auto u = numbers_.of(leaf)) d.put_inside(*u);
  return d;
}

void Elimination::eliminate(int row, int x) {
  const int times = occurrences_.highest(x);
  AffineRow e = defined(row, x);
  occurrences_.enter(rows_[row], -1);
  active_[row] = 0;
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

void Elimination::pass_guard(int x, const AffineRow& e) {
  if (guarded_[x] && !e.terms.empty()) guarded_[numbers_.base(e.terms[0].unknown)] = 1;
}

void Elimination::write_into_others(int x, const AffineRow& e) {
  ++stamp_;
  for (int i : occurrences_.take(x)) {
    if (!active_[i] || seen_[i] == stamp_) continue;
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
      if (e.terms.empty() && e.inside.empty()) read_again(r);
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

void Elimination::read_again(AffineRow& row) const {
  const AffineRow now = affine_row(in_remaining(row.rest), numbers_);
  row.rest = 0;
  row.inside.clear();
  row.add(now, 1);
}

void Elimination::reconsider(int unknown) {
  const int x = numbers_.base(unknown);
  if (occurrences_.count(x) == 0 || occurrences_.count(x) > 3) return;
  const std::vector<int> rows = occurrences_.where(x);
  if (rows.size() > short_row) return;
  for (int i : rows)
    if (active_[i]) consider(i, x);
}

}  // namespace pendula::dae
