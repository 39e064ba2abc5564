// The part of the equations that depends on time alone: the forces of a driven system. The stages of a step
// need it at times that are known before the step, so that one program computes it for several stages at
// once, in lanes.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "codegen/machine/machine.hpp"
#include "codegen/routines/lane_product.hpp"
#include "integrate/problem/problem.hpp"

namespace pendula::integrate {

/// Expressions with their parts that contain t or inputs, but no unknowns, taken out.
struct TimePart {
  /// Nothing is taken out (parts is empty) where only sums and products could be saved.
  TimePart(std::vector<Expr> outputs, const Problem& problem);
  /// Nothing is taken out.
  explicit TimePart(std::vector<Expr> given) : outputs(std::move(given)) {}
  std::vector<Expr> parts;    ///< in t, inputs and parameters
  std::vector<Expr> symbols;  ///< what stands for them
  std::vector<Expr> outputs;  ///< as given, with symbols
};

/// The parts at all stages of a step.
class TimeCode {
 public:
  static constexpr int lanes = 4;
  /// The parts, compiled for lanes, in [t, dt, c, u, p], at t + c dt. Nothing without code generator.
  static std::shared_ptr<const codegen::Machine> compile(const TimePart& part, const Problem& problem);
  /// For these values of c.
  TimeCode(std::shared_ptr<const codegen::Machine> machine, const Problem& problem, std::vector<double> c);

  /// Numbers that run() writes: part k of time i is at [(i / lanes · parts + k) lanes + i % lanes].
  static std::size_t size(std::size_t times, std::size_t parts) { return passes(times) * lanes * parts; }
  static std::size_t place(std::size_t time, std::size_t part, std::size_t parts) {
    return (time / lanes * parts + part) * lanes + time % lanes;
  }
  /// First, since what is written number by number cannot be read four at a time at once.
  void start(double t, double dt);
  /// stages: (t, u) of every time, as write_stages() leaves them. parts: how many there are.
  void run(const Problem& problem, const double* stages, std::size_t parts, double* out);

 private:
  static std::size_t passes(std::size_t times) { return (times + lanes - 1) / lanes; }
  std::shared_ptr<const codegen::Machine> machine_;
  std::size_t times_, inputs_;
  codegen::LaneArray in_, work_;  ///< in_: of all passes
};

}  // namespace pendula::integrate
