// What the writers of first inputs share: a folder of them, bytes put together, and the writers themselves,
// one for each sort of input. Only fuzz_seeds uses this.
#pragma once

#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/file.h"

namespace strandcast {

using SeedBytes = std::vector<std::byte>;

inline SeedBytes bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

/// Numbers one behind the other.
template <class... Numbers>
SeedBytes packed(Numbers... numbers) {
  SeedBytes bytes((sizeof(Numbers) + ...));
  size_t at = 0;
  const auto put = [&](auto number) {
    std::memcpy(bytes.data() + at, &number, sizeof(number));
    at += sizeof(number);
  };
  (put(numbers), ...);
  return bytes;
}

inline SeedBytes joined(std::initializer_list<SeedBytes> parts) {
  SeedBytes bytes;
  for (const SeedBytes& part : parts) bytes.insert(bytes.end(), part.begin(), part.end());
  return bytes;
}

class SeedFolder {
 public:
  explicit SeedFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  void add(const std::string& target, const std::string& name, const SeedBytes& bytes) const {
    std::filesystem::create_directories(folder_ / target);
    CHECK(save_file(folder_ / target / ("seed_" + name), bytes).ok());
  }
  void add(const std::string& target, const std::string& name, std::string_view text) const {
    add(target, name, bytes_of(text));
  }

 private:
  std::filesystem::path folder_;
};

/// Messages, strands, pictures, and blocks of bytes in them (seeds_wire.cpp).
void add_wire_seeds(const SeedFolder& seeds);
/// Hair, scenes, clips, recordings and other files and texts (seeds_files.cpp).
void add_file_seeds(const SeedFolder& seeds);
/// What mocap stages send (seeds_live.cpp).
void add_live_seeds(const SeedFolder& seeds);

}  // namespace strandcast
