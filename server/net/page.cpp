#include "server/net/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>

#include "common/base/text.h"

namespace strandcast {
namespace {

/// Cuts off and gives back what stands before the separator, or all of it.
std::string_view take_part(std::string_view& text, char separator) {
  const size_t end = std::min(text.find(separator), text.size());
  const std::string_view part = trimmed(text.substr(0, end));
  text.remove_prefix(std::min(end + 1, text.size()));
  return part;
}

bool is_same(std::string_view a, std::string_view lower_b) {
  return std::equal(a.begin(), a.end(), lower_b.begin(), lower_b.end(),
                    [](unsigned char x, unsigned char y) { return std::tolower(x) == y; });
}

/// "q=0", "q=0.000": not acceptable (RFC 9110, 12.4.2).
bool is_zero_weight(std::string_view parameter) {
  return parameter.size() > 2 && is_same(parameter.substr(0, 2), "q=") &&
         parameter.find_first_not_of("0.", 2) == std::string_view::npos;
}

}  // namespace

std::string_view path_of_target(std::string_view target) {
  return target.substr(0, target.find('?'));
}

const PageFile* find_page_file(PageFiles files, std::string_view path) {
  const auto found =
      std::find_if(files.begin(), files.end(), [&](const PageFile& file) { return file.path == path; });
  return found == files.end() ? nullptr : &*found;
}

std::string_view name_of(PageCoding coding) {
  switch (coding) {
    case PageCoding::Gzip:
      return "gzip";
    case PageCoding::Brotli:
      return "br";
    case PageCoding::Plain:
      break;
  }
  return "plain";
}

std::string_view content_of(const PageFile& file, PageCoding coding) {
  switch (coding) {
    case PageCoding::Gzip:
      return file.gzip;
    case PageCoding::Brotli:
      return file.brotli;
    case PageCoding::Plain:
      break;
  }
  return file.plain;
}

PageCoding best_coding(std::string_view accept_encoding) {
  bool is_any_accepted = false;
  std::optional<bool> is_brotli_accepted, is_gzip_accepted;  // where they are named
  while (!accept_encoding.empty()) {
    std::string_view entry = take_part(accept_encoding, ',');
    const std::string_view coding = take_part(entry, ';');
    const bool is_accepted = !is_zero_weight(trimmed(entry));
    if (is_same(coding, "br") && !is_brotli_accepted) is_brotli_accepted = is_accepted;
    if (is_same(coding, "gzip") && !is_gzip_accepted) is_gzip_accepted = is_accepted;
    if (coding == "*") is_any_accepted = is_accepted;
  }
  if (is_brotli_accepted.value_or(false)) return PageCoding::Brotli;
  return is_gzip_accepted.value_or(is_any_accepted) ? PageCoding::Gzip : PageCoding::Plain;
}

bool names_tag(std::string_view if_none_match, std::string_view tag) {
  while (!if_none_match.empty()) {
    std::string_view entry = take_part(if_none_match, ',');
    if (entry == "*") return true;
    if (entry.starts_with("W/")) entry.remove_prefix(2);
    if (entry == tag) return true;
  }
  return false;
}

std::string page_policy(std::string_view host) {
  // 'self' does not stand for WebSockets in every browser; a proxy may speak TLS for us.
  return fmt::format(
      "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; "
      "connect-src 'self' ws://{0} wss://{0}; img-src 'self' data: blob:; style-src 'self'; "
      "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
      host);
}

}  // namespace strandcast
