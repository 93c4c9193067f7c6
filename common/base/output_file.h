// OutputFile: a file that is written piece by piece, however large, and is there under its name only once it
// is whole. One thread. And what the files of a program must not be.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

class OutputFile {
 public:
  /// Creates a temporary file beside `path`, and its folder if needed.
  static Result<OutputFile> create(const std::filesystem::path& path);
  /// Removes the temporary file if finish() was not called.
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  OutputFile(const OutputFile&) = delete;

  Status append(std::string_view bytes);
  /// Overwrites the bytes at `offset`.
  Status patch(uint64_t offset, std::string_view bytes);
  /// Renames the file to its final name, replacing an existing one.
  Status finish();

  uint64_t size_bytes() const { return size_bytes_; }

 private:
  OutputFile(std::filesystem::path path, std::filesystem::path part, std::FILE* file);
  Status fail(const char* what) const;

  std::filesystem::path path_;
  std::filesystem::path part_;
  std::FILE* file_;
  uint64_t size_bytes_ = 0;
};

/// Opens /dev/null where standard input, output or error is closed: else the next file has that number, and
/// what the program prints is written into it. The first call in main().
void open_standard_files();

}  // namespace strandcast
