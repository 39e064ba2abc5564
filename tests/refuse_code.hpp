// The system refuses executable memory in the middle of a run, as PR_SET_MDWE does: tried in a child process.
#pragma once

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <doctest/doctest.h>

#include <memory>
#include <vector>

#include "codegen/machine/machine.hpp"

namespace pendula::test {

/// From here on this process gets no executable memory, and what it had is used up. False: no such kernel.
inline bool refuse_executable_memory() {
  constexpr int set_mdwe = 65, refuse_exec_gain = 1;
  if (prctl(set_mdwe, refuse_exec_gain, 0, 0, 0) != 0) return false;
  static std::vector<std::unique_ptr<const codegen::Machine>> kept;
  const Expr x = symbol(Kind::variable, "no_code_x");
  for (int terms : {3000, 300, 30, 3, 1}) {
    Expr e = x;
    for (int k = 0; k < terms; ++k) e = e * x + sin(e);
    const auto program = codegen::lower({&e, 1}, {&x, 1});
    while (auto machine = codegen::Machine::compile(program)) kept.push_back(std::move(machine));
  }
  return true;
}

/// Runs `body`, which returns 0 if all is well, in a child that gets no executable memory any more.
template <class Body>
void check_without_code(const Body& body) {
  constexpr int skipped = 77;
  REQUIRE(codegen::Machine::available());  // the first use is not refused: it would turn code off for good
  const pid_t child = fork();
  if (child == 0) _exit(refuse_executable_memory() ? body() : skipped);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(WIFEXITED(status));
  if (WEXITSTATUS(status) == skipped)
    MESSAGE("skipped: this kernel has no PR_SET_MDWE");
  else
    CHECK(WEXITSTATUS(status) == 0);
}

}  // namespace pendula::test
