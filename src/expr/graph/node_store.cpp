#include "expr/graph/node_store.hpp"

#include <bit>
#include <cmath>

namespace pendula {
namespace {

std::uint64_t hash_of(const Node& n) {
  const std::uint64_t low = n.operand[0].id() | std::uint64_t{n.operand[1].id()} << 32;
  return mix(low ^ mix(n.operand[2].id() | std::uint64_t{static_cast<unsigned>(n.op)} << 32));
}

/// The double nearest to q. CAUTION: mpq get_d truncates, and 981/100 would not be the 9.81 it was read from.
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

std::size_t NodeStore::ValueHash::operator()(const mpq_class& q) const {
  return mix(hash_of(q.get_num()) ^ mix(hash_of(q.get_den())));
}

Expr NodeStore::add(Constant c) { return leaf(Op::constant, constants_.push(std::move(c))); }

Expr NodeStore::exact(const mpq_class& q) {
  if (nodes_.size() > 1 && (q == 0 || q == 1)) return Expr::at(q == 1);
  if (const auto known = exact_.find(q); known != exact_.end()) return Expr::at(*known);
  const Expr made = add({q, nearest_double(q)});
  exact_.insert(made.id());
  return made;
}

Expr NodeStore::whole(long value) {
  if (value < -most_whole || value > most_whole) return exact(mpq_class(value));
  std::uint32_t& known = *(whole_.begin() + most_whole + value);
  if (known == none) known = exact(mpq_class(value)).id();
  return Expr::at(known);
}

Expr NodeStore::inexact(double value) {
  const auto [it, made] = inexact_.try_emplace(std::bit_cast<std::uint64_t>(value));
  if (made) it->second = add({std::nullopt, value});
  return it->second;
}

Expr NodeStore::intern(const Node& n) {
  if (nodes_.size() * 2 > table_.size()) grow();
  const std::size_t mask = table_.size() - 1;
  for (std::size_t i = hash_of(n) & mask;; i = (i + 1) & mask) {
    if (table_[i] == none) return Expr::at(table_[i] = nodes_.push(n));
    const Node& there = nodes_[table_[i]];
    if (there.op == n.op && there.operand == n.operand) return Expr::at(table_[i]);
  }
}

void NodeStore::grow() {
  table_.assign(table_.size() * 2, none);
  const std::size_t mask = table_.size() - 1;
  for (std::uint32_t id = 0; id < nodes_.size(); ++id) {
    if (nodes_[id].op <= Op::call) continue;  // leaves live in tables of their own
    std::size_t i = hash_of(nodes_[id]) & mask;
    while (table_[i] != none) i = (i + 1) & mask;
    table_[i] = id;
  }
}

}  // namespace pendula
