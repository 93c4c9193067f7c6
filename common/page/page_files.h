// The files of the page for browsers (client/web), embedded at build time. Any thread.
#pragma once

#include <span>
#include <string_view>

namespace strandcast {

/// Whether a file's name changes with its content, so that a browser may cache it permanently.
enum class PageFileName { Fixed, Hashed };

struct PageFile {
  std::string_view path = {};  // "/", "/app.0123456789.js"
  std::string_view media_type = {};
  std::string_view version = {};  // of its content: letters and digits
  PageFileName name = PageFileName::Fixed;
  std::string_view plain = {};
  std::string_view gzip = {};
  std::string_view brotli = {};
};
using PageFiles = std::span<const PageFile>;  // without the page: none

/// Returns the files embedded in this program.
PageFiles built_in_page();

}  // namespace strandcast
