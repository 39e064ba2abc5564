// The one main of all doctest suites. CTest runs it once per source file; by hand:
//   build/release/tests/pendula_tests --test-case='order*'
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
