// Shards: what a worker that died has left is used, one of two workers wins, damaged ends are cut off.
#include "store/shard.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>

#include <unistd.h>

#include "base/error.hpp"

namespace pendula::shard_test {

using namespace pendula::store;
namespace fs = std::filesystem;

namespace {

struct Folder {
  std::string name = fs::temp_directory_path() / ("pendula_shards_" + std::to_string(getpid()));
  Folder() {
    fs::remove_all(name);
    fs::create_directories(name);
    std::ofstream(name + "/3") << "11-14 18-18\n";
  }
  ~Folder() { fs::remove_all(name); }
  std::string shard() const { return name + "/3"; }
};

const std::string fingerprint(64, 'a');

Record record(long run) {
  Record r;
  r.run = run;
  r.varied = {1};
  r.numbers = {0.5 * static_cast<double>(run), 2, 3};
  return r;
}

long missing(const Shard& shard) {
  long count = 0;
  for (bool there : shard.finished()) count += there ? 0 : 1;
  return count;
}

}  // namespace

TEST_CASE("ranges are read as they are written") {
  CHECK(read_ranges("1-20 35-35\n") == Ranges{{0, 20}, {34, 35}});
  CHECK(ranges_text({{0, 20}, {34, 35}}) == "1-20 35-35");
  for (const char* wrong : {"", "5", "5-3", "0-3", "a-b", "1-2,3-4x"})
    CHECK_THROWS_AS(read_ranges(wrong), Error);
}

TEST_CASE("a shard is finished once; what came before counts") {
  const Folder folder;
  {
    Shard first(folder.shard(), fingerprint, 20);
    CHECK(first.count() == 5);
    CHECK(missing(first) == 5);
    first.add(std::vector<Record>{record(10), record(17)});
  }  // it dies here; its file is renamed as if it had been on another host
  for (const auto& entry : fs::directory_iterator(folder.name))
    if (entry.path().string().find(".part.") != std::string::npos)
      fs::rename(entry.path(), folder.name + "/3.part.other.1");
  {
    std::ofstream damaged(folder.name + "/3.part.other.1", std::ios::binary | std::ios::app);
    damaged << "half a record";
  }
  Shard second(folder.shard(), fingerprint, 20);
  CHECK(missing(second) == 3);
  second.add(std::vector<Record>{record(11), record(12), record(13)});
  CHECK(second.finish());
  CHECK(second.is_done());
  const auto records = read_shard(folder.shard() + ".done", fingerprint);
  CHECK(records.size() == 5);
  CHECK(records[1].run == 17);
  CHECK(records[1].numbers[0] == 8.5);
  const Shard third(folder.shard(), fingerprint, 20);
  CHECK(third.is_done());
}

TEST_CASE("of two workers on one shard one wins") {
  const Folder folder;
  Shard one(folder.shard(), fingerprint, 20);
  std::vector<Record> all;
  for (long run : {10, 11, 12, 13, 17}) all.push_back(record(run));
  one.add(all);
  std::ofstream(folder.shard() + ".done") << "pendula shard 1\n"
                                          << fingerprint << "\n";  // the other was first
  CHECK_FALSE(one.finish());
  CHECK(read_shard(folder.shard() + ".done", fingerprint).empty());
}

TEST_CASE("what is no shard, or another sweep's") {
  const Folder folder;
  CHECK_THROWS_WITH_AS(Shard(folder.name + "/4", fingerprint, 20), doctest::Contains("there is no shard"),
                       Error);
  CHECK_THROWS_WITH_AS(Shard(folder.shard(), fingerprint, 12),
                       doctest::Contains("runs that the sweep does not have"), Error);
  Shard(folder.shard(), fingerprint, 20);
  for (const auto& entry : fs::directory_iterator(folder.name))
    if (entry.path().string().find(".part.") != std::string::npos)
      CHECK_THROWS_WITH_AS(read_shard(entry.path().string(), std::string(64, 'b')),
                           doctest::Contains("another sweep"), Error);
}

}  // namespace pendula::shard_test
