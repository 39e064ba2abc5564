// The system refuses executable memory in the middle of a run: whoever asks for machine code goes on without.
#include <doctest/doctest.h>

#include <cmath>

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "codegen/kernel/kernel.hpp"
#include "codegen/linear/straight_lu.hpp"
#include "codegen/machine/machine.hpp"
#include "tests/require_code.hpp"

using namespace pendula;
using codegen::Kernel;
using codegen::Machine;

namespace {

Expr long_expression(Expr x, int terms) {
  Expr e = x;
  for (int k = 0; k < terms; ++k) e = e * x + sin(e);
  return e;
}

/// 0: all went well, in a process that gets no executable memory any more.
int after_refusal() {
  constexpr int set_mdwe = 65, refuse_exec_gain = 1, skipped = 77;
  if (prctl(set_mdwe, refuse_exec_gain, 0, 0, 0) != 0) return skipped;
  const Expr x = symbol(Kind::variable, "no_code_x");
  const Expr inputs[] = {x};
  std::vector<std::unique_ptr<const Machine>> kept;
  for (int terms : {3000, 300, 30, 3, 1}) {  // what is left of the memory that was taken before
    const Expr e = long_expression(x, terms);
    const auto program = codegen::lower({&e, 1}, inputs);
    for (int k = 0; k < 100'000; ++k) {
      auto machine = Machine::compile(program);
      if (!machine) break;
      kept.push_back(std::move(machine));
    }
  }
  const Expr e = long_expression(x, 2);
  const Kernel kernel({&e, 1}, inputs);
  if (kernel.accelerate() || kernel.is_machine_code()) return 1;
  const double in = 0.5;
  double out = 0;
  kernel(&in, &out);
  const double one = in * in + std::sin(in), two = one * in + std::sin(one);
  if (out != two) return 2;
  const double matrix[] = {4, 1, 1, 3};
  if (codegen::StraightLU::plan(2, {{0, 0}, {0, 1}, {1, 0}, {1, 1}}, matrix, false)) return 3;
  return 0;
}

}  // namespace

TEST_CASE("machine code: where the system refuses more executable memory, kernels stay on the tape") {
  REQUIRE_CODE(1);
  const pid_t child = fork();
  if (child == 0) _exit(after_refusal());
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 77) {
    MESSAGE("skipped: this kernel has no PR_SET_MDWE");
    return;
  }
  CHECK(WEXITSTATUS(status) == 0);
}
