// The page for browsers: files embedded at build time (client/web), and the decision how a request for one is
// answered. Pure functions on untrusted text, any thread; nothing here sends.
#pragma once

#include <span>
#include <string>
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

/// Returns a request's target up to '?'; the query may hold anything and must not be logged.
std::string_view path_of_target(std::string_view target);

/// Returns the file at this path; nullptr if there is none.
const PageFile* find_page_file(PageFiles files, std::string_view path);

enum class PageCoding { Plain, Gzip, Brotli };
/// Returns HTTP's name of a coding: "plain", "gzip", "br".
std::string_view name_of(PageCoding coding);
std::string_view content_of(const PageFile& file, PageCoding coding);

/// Returns the smallest coding that an Accept-Encoding field permits: Brotli if named, gzip if it or
/// everything is named, otherwise plain.
PageCoding best_coding(std::string_view accept_encoding);

/// Returns whether an If-None-Match field names this entity tag (weak comparison, RFC 9110, 13.1.2) or any.
bool names_tag(std::string_view if_none_match, std::string_view tag);

/// Returns the Content-Security-Policy for a file requested with this (allowed) Host: own scripts, styles and
/// connections, and pictures made by scripts; nothing else.
std::string page_policy(std::string_view host);

}  // namespace strandcast
