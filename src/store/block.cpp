#include <zlib.h>

#include <cstring>
#include <vector>

#include "base/error.hpp"
#include "store/run_store.hpp"

namespace pendula::store {

std::string compressed(std::span<const double> numbers) {
  const std::size_t n = numbers.size();
  std::vector<unsigned char> planes(8 * n);
  const auto* bytes = reinterpret_cast<const unsigned char*>(numbers.data());
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < 8; ++k) planes[k * n + i] = bytes[8 * i + k];
  uLongf size = compressBound(planes.size());
  std::string block(size, '\0');
  constexpr int fast = 1;
  if (compress2(reinterpret_cast<Bytef*>(block.data()), &size, planes.data(), planes.size(), fast) != Z_OK)
    throw Failure("not enough memory to compress results");
  block.resize(size);
  return block;
}

void decompress(std::string_view block, std::span<double> numbers) {
  const std::size_t n = numbers.size();
  std::vector<unsigned char> planes(8 * n);
  uLongf size = planes.size();
  if (uncompress(planes.data(), &size, reinterpret_cast<const Bytef*>(block.data()), block.size()) != Z_OK ||
      size != planes.size())
    throw Error("a block of saved values is damaged");
  auto* bytes = reinterpret_cast<unsigned char*>(numbers.data());
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < 8; ++k) bytes[8 * i + k] = planes[k * n + i];
}

}  // namespace pendula::store
