// The page for browsers as the server has it: files made at build time (client/web), and what of a request
// decides how one of them is answered. Pure functions on untrusted text, any thread; nothing here sends.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace strandcast {

/// Whether a file's name changes with its content, so that a browser may keep it for good.
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

/// What this program was built with.
PageFiles built_in_page();

/// Of a request's target: without what follows a '?', which may hold anything and belongs in no log.
std::string_view path_of_target(std::string_view target);

/// nullptr when there is none at this path.
const PageFile* find_page_file(PageFiles files, std::string_view path);

enum class PageCoding { Plain, Gzip, Brotli };
/// "plain", "gzip", "br": as HTTP calls it.
std::string_view name_of(PageCoding coding);
std::string_view content_of(const PageFile& file, PageCoding coding);

/// The smallest that an Accept-Encoding field allows: Brotli where it is named, gzip where it or everything
/// is, and neither where it is unwanted.
PageCoding best_coding(std::string_view accept_encoding);

/// True when an If-None-Match field names this entity tag (weakly compared, RFC 9110, 13.1.2) or any.
bool names_tag(std::string_view if_none_match, std::string_view tag);

/// The Content-Security-Policy of a file that was asked for by this Host, which must be an allowed one: own
/// scripts, styles and connections, pictures that scripts made, and nothing of anybody else.
std::string page_policy(std::string_view host);

}  // namespace strandcast
