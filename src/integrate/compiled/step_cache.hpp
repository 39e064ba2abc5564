// Parts of the programs that do whole steps (explicit_step.hpp, newton_step.hpp), and their cache
// by equations and coefficients.
#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "codegen/machine/machine.hpp"
#include "codegen/program/program_cache.hpp"
#include "codegen/program/writer.hpp"
#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// Instructions of the longest program, 1 ms to compile: beyond, the equations dominate.
constexpr std::size_t longest_step_program = 6000;

void add(codegen::Key& key, double value);
void add(codegen::Key& key, std::span<const Expr> list);

/// Compiled programs, or the number of requests so far.
struct StepEntry {
  std::vector<std::shared_ptr<const codegen::Machine>> machines;
  long wanted = 0;
  bool is_refused = false;  ///< too long, or not possible
  std::size_t handed = 0;   ///< numbers that the second machine hands to the first, if there are two
  std::vector<std::shared_ptr<const void>> kept;  ///< whose addresses are in the key

  /// Keeps the machines of one step if all of them could be compiled; otherwise none: there is no step
  /// without executable memory.
  void keep_if_complete(std::vector<std::shared_ptr<const codegen::Machine>> compiled);
};

struct StepStore {
  std::mutex mutex;
  codegen::ProgramCache<StepEntry> entries;
  std::shared_ptr<StepEntry> entry(const codegen::Key& key);
};
StepStore& step_store();

std::vector<codegen::Slot> inputs_from(const codegen::Writer& w, std::size_t first, std::size_t count);
std::vector<double> row_of(const Mat& A, int i, int count);
/// Arguments [t, x, x′, z, u, p] of a kernel.
std::vector<codegen::Slot> arguments(codegen::Slot t,
                                     std::initializer_list<std::span<const codegen::Slot>> groups);

inline std::size_t parameter_count(const Problem& problem) { return problem.model().p.size(); }
inline std::size_t input_count(const Problem& problem) { return problem.model().u.size(); }
/// Copies the values of the parameters; the end of what was written.
double* write_parameters(const Problem& problem, double* to);
/// t + c dt and u there, for every c, behind one another.
void write_stages(Problem& problem, std::span<const double> c, double t, double dt, double* to);

}  // namespace pendula::integrate
