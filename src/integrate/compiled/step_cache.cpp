#include "integrate/compiled/step_cache.hpp"

#include <algorithm>
#include <bit>

namespace pendula::integrate {

using codegen::Key;
using codegen::Slot;
using codegen::Writer;

void add(Key& key, double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  key.push_back(static_cast<std::uint32_t>(bits));
  key.push_back(static_cast<std::uint32_t>(bits >> 32));
}

void add(Key& key, std::span<const Expr> list) {
  key.push_back(static_cast<std::uint32_t>(list.size()));
  for (Expr e : list) key.push_back(e.id());
}

void StepEntry::keep_if_complete(std::vector<std::shared_ptr<const codegen::Machine>> compiled) {
  if (std::find(compiled.begin(), compiled.end(), nullptr) == compiled.end()) machines = std::move(compiled);
}

std::shared_ptr<StepEntry> StepStore::entry(const Key& key) {
  auto found = entries.find(key);
  if (!found) entries.add(key, found = std::make_shared<StepEntry>(), 1000);
  return found;
}

StepStore& step_store() {
  static StepStore store;
  return store;
}

std::vector<Slot> inputs_from(const Writer& w, std::size_t first, std::size_t count) {
  std::vector<Slot> list;
  for (std::size_t k = 0; k < count; ++k) list.push_back(w.input(first + k));
  return list;
}

std::vector<double> row_of(const Mat& A, int i, int count) {
  std::vector<double> row;
  for (int j = 0; j < count; ++j) row.push_back(A(i, j));
  return row;
}

std::vector<Slot> arguments(Slot t, std::initializer_list<std::span<const Slot>> groups) {
  std::vector<Slot> list{t};
  for (const auto& group : groups) list.insert(list.end(), group.begin(), group.end());
  return list;
}

double* write_parameters(const Problem& problem, double* to) {
  const auto& values = problem.values();
  return std::copy(values.end() - static_cast<std::ptrdiff_t>(parameter_count(problem)), values.end(), to);
}

void write_stages(Problem& problem, std::span<const double> c, double t, double dt, double* to) {
  const std::size_t count = input_count(problem);
  for (double node : c) {
    *to++ = t + node * dt;
    if (count == 0) continue;
    problem.set_time(t + node * dt);
    const auto behind = static_cast<std::ptrdiff_t>(count + parameter_count(problem));
    to = std::copy_n(problem.values().end() - behind, count, to);
  }
}

}  // namespace pendula::integrate
