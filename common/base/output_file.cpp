#include "common/base/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

namespace strandcast {

Result<OutputFile> OutputFile::create(const std::filesystem::path& path) {
  if (std::error_code failure; path.has_parent_path()) {
    std::filesystem::create_directories(path.parent_path(), failure);
    if (failure) return at(path.string(), make_error(ErrorCode::BadInput, "{}", failure.message()));
  }
  std::filesystem::path part = path;
  part += ".part";
  std::FILE* const file = std::fopen(part.c_str(), "wb");
  if (file == nullptr)
    return at(path.string(), make_error(ErrorCode::BadInput, "cannot be written: {}", std::strerror(errno)));
  return OutputFile(path, std::move(part), file);
}

OutputFile::OutputFile(std::filesystem::path path, std::filesystem::path part, std::FILE* file)
    : path_(std::move(path)), part_(std::move(part)), file_(file) {}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      part_(std::move(other.part_)),
      file_(std::exchange(other.file_, nullptr)),
      size_bytes_(other.size_bytes_) {}

OutputFile::~OutputFile() {
  if (file_ == nullptr) return;
  std::fclose(file_);
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);
}

Status OutputFile::fail(const char* what) const {
  return at(path_.string(), make_error(ErrorCode::BadInput, "{}: {}", what, std::strerror(errno)));
}

Status OutputFile::append(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) return fail("cannot be written");
  size_bytes_ += bytes.size();
  return {};
}

Status OutputFile::patch(uint64_t offset, std::string_view bytes) {
  if (std::fseek(file_, static_cast<long>(offset), SEEK_SET) != 0 ||
      std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size() ||
      std::fseek(file_, 0, SEEK_END) != 0)
    return fail("cannot be written");
  return {};
}

Status OutputFile::finish() {
  const bool is_written = std::fclose(std::exchange(file_, nullptr)) == 0;
  std::error_code failure;
  if (is_written) std::filesystem::rename(part_, path_, failure);
  if (is_written && !failure) return {};
  const Status failed = is_written
                            ? at(path_.string(), make_error(ErrorCode::BadInput, "{}", failure.message()))
                            : fail("cannot be written");
  std::filesystem::remove(part_, failure);
  return failed;
}

void open_standard_files() {
  for (const int file : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(file, F_GETFD) < 0 && ::open("/dev/null", O_RDWR) < 0) std::abort();
}

}  // namespace strandcast
