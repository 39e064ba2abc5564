#include "sysid/data/mat_memory.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <vector>

#include <unistd.h>
#include <zlib.h>

#include "base/error.hpp"
#include "base/interrupt.hpp"

namespace pendula::sysid {
namespace {

constexpr std::uintmax_t most_compression = 1032;  // maximum for deflate: 258 bytes from two bits

/// The unpacked size of the next `packed` bytes of a file, as far as they can be unpacked.
std::uintmax_t inflated_size(std::istream& in, std::uintmax_t packed) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return packed * most_compression;
  std::vector<unsigned char> from(1 << 16), to(1 << 18);  // buffers that fit into the cache
  std::uintmax_t size = 0;
  int state = Z_OK;
  while (packed > 0 && state == Z_OK) {
    poll_interrupt();
    in.read(reinterpret_cast<char*>(from.data()),
            static_cast<std::streamsize>(std::min<std::uintmax_t>(packed, from.size())));
    if (in.gcount() <= 0) break;
    packed -= static_cast<std::uintmax_t>(in.gcount());
    stream.next_in = from.data();
    stream.avail_in = static_cast<unsigned>(in.gcount());
    do {
      stream.next_out = to.data();
      stream.avail_out = static_cast<unsigned>(to.size());
      state = inflate(&stream, Z_NO_FLUSH);
      size += to.size() - stream.avail_out;
    } while (state == Z_OK && stream.avail_out == 0);
    if (state == Z_BUF_ERROR) state = Z_OK;  // more input is required
  }
  inflateEnd(&stream);
  return size;
}

/// Level 5 files begin with a header of 128 bytes that ends with the version and the byte order. Elements
/// with a tag of type and length follow ("MAT-File Format", The MathWorks, "Level 5 MAT-Files").
constexpr std::streamoff header = 128;
enum class Order { little, big, not_level_5 };

Order byte_order(std::istream& in) {
  std::array<unsigned char, 4> last{};
  in.seekg(header - 4);
  if (!in.read(reinterpret_cast<char*>(last.data()), last.size())) return Order::not_level_5;
  const auto ends_with = [&](std::array<unsigned char, 4> wanted) { return last == wanted; };
  if (ends_with({0x00, 0x01, 'I', 'M'})) return Order::little;
  if (ends_with({0x01, 0x00, 'M', 'I'})) return Order::big;
  return Order::not_level_5;
}

}  // namespace

std::uintmax_t unpacked_size(const std::string& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) return 0;
  const auto bytes = static_cast<std::uintmax_t>(in.tellg());
  const Order order = byte_order(in);
  if (order == Order::not_level_5) return bytes * most_compression;
  constexpr std::uint32_t matrix = 14, compressed = 15;  // miMATRIX, miCOMPRESSED; libmatio rejects others
  std::uintmax_t size = bytes, at = header;
  std::uint32_t tag[2];
  while (in.clear(), in.seekg(static_cast<std::streamoff>(at)),
         in.read(reinterpret_cast<char*>(tag), sizeof tag)) {
    if ((order == Order::little) != (std::endian::native == std::endian::little))
      for (std::uint32_t& word : tag) word = __builtin_bswap32(word);
    if ((tag[0] != matrix && tag[0] != compressed) || tag[1] == 0) break;
    at += sizeof tag;
    if (tag[1] > bytes - at) throw Error("it ends in the middle of a variable: it is damaged");
    if (tag[0] == compressed) size += inflated_size(in, tag[1]);
    at += tag[1];
  }
  return size;
}

MemoryLimit::MemoryLimit(std::uintmax_t more) {
  std::ifstream pages("/proc/self/statm");
  std::uintmax_t data = 0;  // the sixth number of the header
  for (int k = 0; k < 6; ++k) pages >> data;
  if (!pages || getrlimit(RLIMIT_DATA, &before_) != 0) return;
  const std::uintmax_t limit = data * static_cast<std::uintmax_t>(sysconf(_SC_PAGESIZE)) + more;
  if (limit >= before_.rlim_cur) return;
  const rlimit lower{static_cast<rlim_t>(limit), before_.rlim_max};
  changed_ = setrlimit(RLIMIT_DATA, &lower) == 0;
}

MemoryLimit::~MemoryLimit() {
  if (changed_) setrlimit(RLIMIT_DATA, &before_);
}

}  // namespace pendula::sysid
