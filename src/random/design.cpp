#include "random/design.hpp"

#include <algorithm>

#include "base/epsilon.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "random/philox.hpp"

namespace pendula::random {
namespace {

using Kind = DesignRequest::Kind;

/// The middle of cell k of n.
double middle(long k, long n) { return (static_cast<double>(k) + 0.5) / static_cast<double>(n); }

long grid_runs(const DesignRequest& r) {
  long runs = 1;
  for (int j = 0; j < r.dimensions; ++j) {
    runs *= r.levels;
    if (runs > most_runs)
      throw Error(
          text("a grid of ", r.levels, " levels in ", r.dimensions,
               " dimensions has more than 10 000 000 points; give fewer levels, or design = \"sobol\""));
  }
  return runs;
}

}  // namespace

const std::vector<std::string>& design_names() {
  static const std::vector<std::string> names = {"monte carlo", "latin hypercube", "sobol", "halton", "grid",
                                                 "star",        "saltelli",        "morris"};
  return names;
}

Kind design_kind(const std::string& name) {
  const auto& names = design_names();
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end())
    throw Error(text("unknown design '", name, "'.", did_you_mean(name, names),
                     " (designs: ", join(names, ", "), ")"));
  return static_cast<Kind>(at - names.begin());
}

std::string name_of(Kind kind) { return design_names()[static_cast<int>(kind)]; }

Design::Design(DesignRequest request) : request_(std::move(request)) {
  DesignRequest& r = request_;
  const int d = r.dimensions;
  const bool by_levels = r.kind == Kind::grid || r.kind == Kind::star;
  if (r.kind == Kind::morris && r.levels == 0) r.levels = 4;
  if (r.kind == Kind::star && r.levels == 0) r.levels = 2;
  if (by_levels && r.runs != 0)
    throw Error(text("the number of runs of design = \"", name_of(r.kind),
                     "\" follows from levels = …; leave runs out"));
  if (by_levels && r.levels < 1)
    throw Error("design = \"grid\" needs levels = 5, the number of points per axis");
  if (r.kind == Kind::morris && (r.levels < 2 || r.levels % 2 != 0))
    throw Error(text("levels = ", r.levels, "; design = \"morris\" needs an even number, 4 for example"));
  if (!by_levels && r.runs < 1) throw Error("distributions need runs = 1000, the number of samples");
  const int needed = r.kind == Kind::saltelli ? 2 * d : d;
  if ((r.kind == Kind::sobol || r.kind == Kind::saltelli) && needed > most_sobol_dimensions)
    throw Error(text(needed, " dimensions are needed, but the table of Sobol' sequences ends at ",
                     most_sobol_dimensions, "; write design = \"latin hypercube\" or \"monte carlo\""));
  runs_ = r.kind == Kind::grid       ? grid_runs(r)
          : r.kind == Kind::star     ? 1 + static_cast<long>(d) * r.levels
          : r.kind == Kind::saltelli ? r.runs * (d + 2)
          : r.kind == Kind::morris   ? r.runs * (d + 1)
                                     : r.runs;
  if (runs_ > most_runs) throw Error(text("these are ", runs_, " runs; at most 10 000 000 are made"));
}

double Design::unit(long run, int dimension) const {
  const DesignRequest& r = request_;
  const auto number = static_cast<std::uint64_t>(run);
  const auto series = static_cast<std::uint32_t>(dimension);
  switch (r.kind) {
    case Kind::monte_carlo:
      return uniform_at({r.seed, Use::design, number, series});
    case Kind::latin_hypercube: {
      const std::uint64_t cell = permuted(number, static_cast<std::uint64_t>(r.runs), r.seed, series);
      const double u = (static_cast<double>(cell) + uniform_at({r.seed, Use::design, number, series})) /
                       static_cast<double>(r.runs);
      return std::min(u, 1 - eps / 2);  // the largest double below 1
    }
    case Kind::sobol:
      return sobol(number, dimension, r.scramble, r.seed);
    case Kind::halton:
      return halton(number, dimension, r.scramble, r.seed);
    case Kind::grid: {  // the last dimension varies fastest
      long rest = run;
      for (int j = r.dimensions - 1; j > dimension; --j) rest /= r.levels;
      return middle(rest % r.levels, r.levels);
    }
    case Kind::star:
      if (run == 0 || (run - 1) / r.levels != dimension) return 0.5;
      return middle((run - 1) % r.levels, r.levels);
    case Kind::saltelli:
      return saltelli(run, dimension);
    case Kind::morris:
      return morris(run, dimension);
  }
  return 0;
}

double Design::saltelli(long run, int dimension) const {
  const int d = request_.dimensions;
  const long block = run % (d + 2);
  const bool from_B = block == 1 || block == 2 + dimension;
  return sobol(static_cast<std::uint64_t>(run / (d + 2)), from_B ? d + dimension : dimension,
               request_.scramble, request_.seed);
}

/// Coordinate j begins in the lower or upper half of the levels and changes by half of their number
/// in step π(j).
double Design::morris(long run, int dimension) const {
  const DesignRequest& r = request_;
  const auto trajectory = static_cast<std::uint64_t>(run / (r.dimensions + 1));
  const long step = run % (r.dimensions + 1);
  const auto series = static_cast<std::uint32_t>(dimension);
  const long half = r.levels / 2;
  const std::uint64_t random = bits_at({r.seed, Use::design, trajectory, series});
  const auto low = static_cast<long>((random >> 1) % static_cast<std::uint64_t>(half));
  const bool rising = random & 1;
  const auto turn =
      static_cast<long>(permuted(series, static_cast<std::uint64_t>(r.dimensions),
                                 r.seed ^ bits_at({r.seed, Use::permutation, trajectory, 0}), 1));
  const bool moved = step > turn;
  // From 0.5 % to 99.5 %: the distributions may be unbounded, and midpoints of the cells would alias
  // with periodic functions.
  const auto level = static_cast<double>(low + (moved == rising ? half : 0));
  return 0.005 + 0.99 * level / static_cast<double>(r.levels - 1);
}

}  // namespace pendula::random
