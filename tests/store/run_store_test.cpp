// The file of a sweep: fingerprints, blocks, tables, who may write.
#include "store/run_store.hpp"

#include <doctest/doctest.h>

#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numeric>

#include "base/error.hpp"
#include "store/sha256.hpp"

namespace pendula::run_store_test {

using namespace pendula::store;

namespace {

struct TemporaryFile {
  std::string name =
      std::filesystem::temp_directory_path() / ("pendula_store_" + std::to_string(::getpid()) + ".db");
  TemporaryFile() { remove(); }
  ~TemporaryFile() { remove(); }
  void remove() {
    for (const char* tail : {"", "-wal", "-shm"}) std::filesystem::remove(name + tail);
  }
};

Description description(long runs = 10) {
  Description d;
  d.fingerprint = sha256("model");
  d.program = "pendula";
  d.model = "return 1";
  d.options = "return {}";
  d.runs = runs;
  d.varied = {"k", "x(0)"};
  d.leaves = {"t", "x", "X", "x'"};
  d.shown = {false, true, true, false};
  d.times = {0, 0.5, 1};
  return d;
}

Record record(long run) {
  Record r;
  r.run = run;
  r.varied = {1.5, 0.1 * static_cast<double>(run)};
  for (int i = 0; i < Record::head + 4 * 4; ++i) r.numbers.push_back(100 * static_cast<double>(run) + i);
  return r;
}

Record failed(long run) {
  Record r;
  r.run = run;
  r.done = false;
  r.why = "step size vanished";
  r.varied = {1, 2};
  return r;
}

}  // namespace

TEST_CASE("SHA-256: the examples of its standard") {
  CHECK(sha256("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  CHECK(sha256("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  CHECK(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq") ==
        "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

TEST_CASE("blocks: the same bits come back, and smooth numbers take less room") {
  std::vector<double> numbers(1000), back(1000);
  for (int i = 0; i < 1000; ++i) numbers[i] = std::sin(0.01 * i);
  numbers[5] = -0.0;
  numbers[7] = std::nan("");
  const std::string block = compressed(numbers);
  CHECK(block.size() < 8000);
  decompress(block, back);
  CHECK(std::memcmp(numbers.data(), back.data(), 8000) == 0);
  CHECK_THROWS_WITH_AS(decompress(block.substr(0, block.size() / 2), back), doctest::Contains("damaged"),
                       Error);
}

TEST_CASE("what was added is there in the next session, once") {
  const TemporaryFile file;
  {
    RunStore store(file.name, description());
    const std::vector<Record> some = {record(2), record(0), failed(4)};
    store.add(some);
    store.add(std::vector<Record>{record(2), record(3)});  // 2 is there already
  }
  RunStore store(file.name);
  CHECK(store.description().leaves == description().leaves);
  CHECK(store.description().times == description().times);
  CHECK(store.description().varied == description().varied);
  CHECK(store.done() == 3);
  CHECK(store.failed() == std::vector<long>{4});
  CHECK(store.failure(4) == "step size vanished");
  CHECK(store.state(4) == RunStore::State::failed);
  CHECK(store.state(1) == RunStore::State::waiting);
  const auto there = store.finished();
  CHECK(std::accumulate(there.begin(), there.end(), 0) == 4);
  std::vector<long> seen;
  store.visit(0, [&](long run, const double* head, const double* leaves) {
    seen.push_back(run);
    CHECK(head[1] == 100 * static_cast<double>(run) + 1);
    CHECK(leaves[3] == 100 * static_cast<double>(run) + 7);
  });
  CHECK(seen == std::vector<long>{0, 2, 3});
  store.visit(3, [&](long run, const double*, const double* leaves) {
    CHECK(leaves[0] == 100 * static_cast<double>(run) + 4 + 12);
  });
  store.forget_failures();
  CHECK(store.failed().empty());
}

TEST_CASE("columns: names that differ in case only, and values that are not numbers") {
  const TemporaryFile file;
  RunStore store(file.name, description());
  Record r = record(1);
  r.numbers[Record::head + 1] = std::nan("");
  store.add(std::vector<Record>{r});
  Database database(file.name, false);
  Statement select(database, "SELECT k, \"x(0)\", x, X_2, t FROM runs WHERE run = 2");
  CHECK(select.step());
  CHECK(select.number(0) == 1.5);
  CHECK(std::isnan(select.number(2)));
  CHECK(select.number(3) == 106);
}

TEST_CASE("another sweep, another file, another writer") {
  const TemporaryFile file;
  {
    RunStore store(file.name, description());
    const RunStore::Lock lock(store);
    CHECK_THROWS_WITH_AS(RunStore::Lock second(store), doctest::Contains("being written"), Error);
  }
  Description other = description();
  other.fingerprint = sha256("another model");
  CHECK_THROWS_WITH_AS(RunStore(file.name, other), doctest::Contains("holds another sweep (10 runs)"), Error);
  CHECK_THROWS_WITH_AS(RunStore("/nowhere/runs.db", description()),
                       doctest::Contains("no such file or folder"), Error);
  TemporaryFile text;
  text.remove();
  std::ofstream(text.name)
      << "this is a text that is long enough not to be taken for an empty file, whatever it says "
         "about itself in its first hundred bytes\n";
  CHECK_THROWS_WITH_AS(RunStore(text.name, description()), doctest::Contains("not a store of runs"), Error);
  text.remove();
  Database(text.name, true).run("CREATE TABLE mine (a)");
  CHECK_THROWS_WITH_AS(RunStore(text.name, description()), doctest::Contains("not a store of runs"), Error);
}

}  // namespace pendula::run_store_test
