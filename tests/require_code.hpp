// Tests of machine code say so where there is none, instead of passing without an assertion.
#pragma once

#include <doctest/doctest.h>

#include "codegen/machine/machine.hpp"

/// Leaves the test, with a message, where no machine code can be made for that many lanes.
#define REQUIRE_CODE(lanes)                                                                      \
  do {                                                                                           \
    if (!pendula::codegen::Machine::available(lanes)) {                                          \
      MESSAGE("skipped: no machine code for ", lanes, " lane(s) in this build or on this host"); \
      return;                                                                                    \
    }                                                                                            \
  } while (false)
