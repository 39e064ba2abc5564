// The system refuses executable memory in the middle of a run: whoever asks for machine code goes on without.
#include <doctest/doctest.h>

#include <cmath>

#include "codegen/kernel/kernel.hpp"
#include "codegen/linear/straight_lu.hpp"
#include "tests/refuse_code.hpp"
#include "tests/require_code.hpp"

namespace pendula::no_executable_memory_test {

using codegen::Kernel;

TEST_CASE("machine code: where the system refuses more executable memory, kernels stay on the tape") {
  REQUIRE_CODE(1);
  test::check_without_code([] {
    const Expr x = symbol(Kind::variable, "no_code_x");
    const Expr once = x * x + sin(x), e = once * x + sin(once);
    const Kernel kernel({&e, 1}, {&x, 1});
    if (kernel.accelerate() || kernel.is_machine_code()) return 1;
    const double in = 0.5;
    double out = 0;
    kernel(&in, &out);
    const double one = in * in + std::sin(in), two = one * in + std::sin(one);
    if (out != two) return 2;
    const double matrix[] = {4, 1, 1, 3};
    if (codegen::StraightLU::plan(2, {{0, 0}, {0, 1}, {1, 0}, {1, 1}}, matrix, false)) return 3;
    return 0;
  });
}

}  // namespace pendula::no_executable_memory_test
