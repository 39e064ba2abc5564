// Designs of experiments in the unit cube: run number and coordinate in, number out.
//
// A coordinate depends on design, seed, run and dimension only. Nothing is stored, so that ten million runs
// cost no memory and results do not depend on how the runs are divided among processes.
#pragma once

#include <string>
#include <vector>

#include "random/sobol.hpp"

namespace pendula::random {

inline constexpr long most_runs = 10'000'000;  ///< of one sweep: 80 MB for each number that is kept of a run

struct DesignRequest {
  enum class Kind { monte_carlo, latin_hypercube, sobol, halton, grid, star, saltelli, morris };
  Kind kind = Kind::monte_carlo;
  long runs = 0;  ///< saltelli: base points; morris: trajectories; grid, star: not used
  int dimensions = 0;
  std::uint64_t seed = 0;
  Scramble scramble = Scramble::owen;
  int levels = 0;  ///< grid: points per axis; star: points per arm; morris: levels of the lattice
};

/// "monte carlo", …; for options and errors.
const std::vector<std::string>& design_names();
DesignRequest::Kind design_kind(const std::string& name);  ///< throws Error with "did you mean"
std::string name_of(DesignRequest::Kind kind);

class Design {
 public:
  /// Throws Error for too many dimensions, levels or runs, with the option that mends it.
  explicit Design(DesignRequest request);
  const DesignRequest& request() const { return request_; }
  /// grid: levelsᵈ. star: 1 + d·levels, the centre first. saltelli: N(d + 2), for each base point A, B, then
  /// A with coordinate i from B (Saltelli et al., Comput. Phys. Commun. 181, 2010). morris: r(d + 1),
  /// trajectories of one step per coordinate by half of the levels, which lie between 0.5 % and 99.5 %
  /// (Morris, Technometrics 33(2), 1991).
  long runs() const { return runs_; }
  /// In (0, 1); unscrambled sequences: in [0, 1).
  double unit(long run, int dimension) const;

 private:
  double saltelli(long run, int dimension) const;
  double morris(long run, int dimension) const;
  DesignRequest request_;
  long runs_ = 0;
};

}  // namespace pendula::random
