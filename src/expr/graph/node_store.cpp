#include "expr/graph/node_store.hpp"

#include <bit>
#include <cmath>
#include <limits>
#include <span>

namespace pendula {
namespace {

std::uint64_t hash_of(const Node& n) {
  const std::uint64_t low = n.operand[0].id() | std::uint64_t{n.operand[1].id()} << 32;
  return mix(low ^ mix(n.operand[2].id() | std::uint64_t{static_cast<unsigned>(n.op)} << 32));
}

/// The double nearest to q. CAUTION: mpq get_d truncates, and 981/100 would not give 9.81.
double nearest_double(const mpq_class& q) {
  const double below = q.get_d();  // towards zero
  const double above = std::nextafter(below, q < 0 ? -HUGE_VAL : HUGE_VAL);
  if (!std::isfinite(below) || !std::isfinite(above)) return below;
  const int order = cmp(mpq_class(abs(q - mpq_class(below))), mpq_class(abs(mpq_class(above) - q)));
  const bool even = std::bit_cast<std::uint64_t>(below) % 2 == 0;
  return order < 0 || (order == 0 && even) ? below : above;
}

std::uint64_t hash_of(const mpz_class& z) {
  std::uint64_t h = sgn(z) < 0;
  for (std::size_t k = mpz_size(z.get_mpz_t()); k-- > 0;)
    h = mix(h ^ mpz_getlimbn(z.get_mpz_t(), static_cast<mp_size_t>(k)));
  return h;
}

}  // namespace

NodeStore::NodeStore() {
  whole_.fill(none);
  exact(0);  // the default Expr
  exact(1);
}

Expr NodeStore::push(Node n) {
  n.first = n.last = window_;
  ++in_use_;
  return Expr::at(nodes_.push(n));
}

Expr NodeStore::touched(std::uint32_t id) {
  touch(id);
  return Expr::at(id);
}

std::size_t NodeStore::ValueHash::operator()(const mpq_class& q) const {
  return mix(hash_of(q.get_num()) ^ mix(hash_of(q.get_den())));
}

Expr NodeStore::add(Constant c) {
  if (free_constants_.empty()) return leaf(Op::constant, constants_.push(std::move(c)));
  const std::uint32_t place = free_constants_.back();
  free_constants_.pop_back();
  constants_[place] = std::move(c);
  return leaf(Op::constant, place);
}

Expr NodeStore::exact(const mpq_class& q) {
  if (nodes_.size() > 1 && (q == 0 || q == 1)) return Expr::at(q == 1);
  if (const auto known = exact_.find(q); known != exact_.end()) return touched(*known);
  const Expr made = add({q, nearest_double(q)});
  exact_.insert(made.id());
  return made;
}

Expr NodeStore::whole(long value) {
  if (value < -most_whole || value > most_whole) return exact(mpq_class(value));
  std::uint32_t& known = *(whole_.begin() + most_whole + value);
  if (known == none) known = exact(mpq_class(value)).id();
  return touched(known);
}

Expr NodeStore::inexact(double value) {
  const auto [it, made] = inexact_.try_emplace(std::bit_cast<std::uint64_t>(value));
  if (made) it->second = add({std::nullopt, value});
  return touched(it->second.id());
}

Expr NodeStore::intern(const Node& n) {
  if (nodes_in_table_ * 2 > table_.size()) fill_table(table_.size() * 2);
  const std::size_t mask = table_.size() - 1;
  for (std::size_t i = hash_of(n) & mask;; i = (i + 1) & mask) {
    if (table_[i] == none) {
      ++nodes_in_table_;
      return Expr::at(table_[i] = push(n).id());
    }
    const Node& there = nodes_[table_[i]];
    if (there.op == n.op && there.operand == n.operand) return touched(table_[i]);
  }
}

void NodeStore::fill_table(std::size_t size) {
  table_.assign(size, none);
  table_.shrink_to_fit();
  nodes_in_table_ = 0;
  const std::size_t mask = size - 1;
  nodes_.each_from_last([&](std::uint32_t id, const Node& n) {
    if (n.op <= Op::call || n.op == Node::nothing) return;  // leaves are stored in separate tables
    std::size_t i = hash_of(n) & mask;
    while (table_[i] != none) i = (i + 1) & mask;
    table_[i] = id;
    ++nodes_in_table_;
  });
}

bool NodeStore::begin_window() {
  if (window_ == std::numeric_limits<std::uint16_t>::max()) return false;
  ++window_;
  return true;
}

void NodeStore::touch_operands(const Node& n) {
  if (n.op == Op::solve && n.operand[1].id() > 0) return touch(n.operand[2].id());
  if (n.op == Op::call || n.op == Op::solve) {
    for (Expr operand :
         n.op == Op::call ? call_operands(n.operand[0].id()) : solve_operands(n.operand[0].id()))
      touch(operand.id());
  } else if (n.op > Op::solve) {
    for (Expr operand : std::span(n.operand.data(), static_cast<std::size_t>(info(n.op).arity)))
      touch(operand.id());
  }
}

void NodeStore::free(std::uint32_t id, Node& n) {
  if (n.op == Op::constant) {
    Constant& c = constants_[n.operand[0].id()];
    if (c.exact)
      exact_.erase(id);
    else
      inexact_.erase(std::bit_cast<std::uint64_t>(c.value));
    std::replace(whole_.begin(), whole_.end(), id, none);
    c = {};
    free_constants_.push_back(n.operand[0].id());
  } else if (n.op == Op::call) {
    give_back_call(n.operand[0].id());
  } else if (n.op == Op::solve && n.operand[1].id() == 0) {
    give_back_system(n.operand[0].id());
  }
  n.op = Node::nothing;
  --in_use_;
}

void NodeStore::give_back(const std::vector<std::uint16_t>& windows) {
  free_constants_.reserve(constants_.size());  // memory may run out here, but not later
  touch(0);                                    // the numbers 0 and 1
  touch(1);
  const auto stays = [&](const Node& n) {
    if (n.last == window_) return true;
    const auto at = std::ranges::lower_bound(windows, n.first);
    return at != windows.end() && *at <= n.last;
  };
  nodes_.each_from_last([&](std::uint32_t id, Node& n) {
    if (n.op == Node::nothing) return;
    if (stays(n))
      touch_operands(n);
    else
      free(id, n);
  });
  nodes_.give_back_unless([](const Node& n) { return n.op != Node::nothing; });
  std::size_t room = least_room;
  while (room < table_.size() && room < 2 * static_cast<std::size_t>(in_use_)) room *= 2;
  fill_table(room);
}

}  // namespace pendula
