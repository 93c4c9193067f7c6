// What of a request decides how a file of the page is answered.
#include "server/net/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strandcast::page_test {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(PageFiles, AreFoundByTheirWholePath) {
  const PageFile files[] = {{.path = "/"}, {.path = "/app.01.js"}};
  EXPECT_EQ(find_page_file(files, "/"), &files[0]);
  EXPECT_EQ(find_page_file(files, "/app.01.js"), &files[1]);
  for (const char* path : {"", "/app.01.jsx", "/app.01.j", "//", "app.01.js", "/./", "/APP.01.js", "*"})
    EXPECT_EQ(find_page_file(files, path), nullptr) << path;
  EXPECT_EQ(find_page_file({}, "/"), nullptr);
}

TEST(PageFiles, APathEndsWhereAQuestionBegins) {
  EXPECT_EQ(path_of_target("/?token=secret?more"), "/");
  EXPECT_EQ(path_of_target("/app.js"), "/app.js");
  EXPECT_EQ(path_of_target("?"), "");
}

// RFC 9110, 12.5.3 with its examples.
TEST(PageCoding, IsTheSmallestThatIsTaken) {
  for (const char* field :
       {"gzip", "compress, gzip", "gzip;q=1.0, identity; q=0.5, *;q=0", "*", "GZip", "deflate,gzip,br;q=0",
        " gzip ; q=0.001", "*;q=0.5", "*;q=0, gzip", "*, br;q=0", "brotli, gzip", "br; q=0.0 , gzip"})
    EXPECT_EQ(name_of(best_coding(field)), "gzip") << field;
  for (const char* field :
       {"br", "gzip, deflate, br", "BR;q=0.5", "*;q=0, br", "gzip;q=0, br", "br, gzip, br;q=0"})
    EXPECT_EQ(name_of(best_coding(field)), "br") << field;
  for (const char* field : {"", "identity", "gzip;q=0", "gzip; q=0.000", "*;q=0", "*, gzip;q=0", "xgzip",
                            "gzipx", "b r", "brr", ",", ";", ",;,", "gzip;Q=0", "br;q=0", "br;q=0, gzip;q=0"})
    EXPECT_EQ(name_of(best_coding(field)), "plain") << field;
}

TEST(PageCoding, HasTheContentOfItsName) {
  const PageFile file{.plain = "as it is", .gzip = "by gzip", .brotli = "by Brotli"};
  EXPECT_EQ(content_of(file, PageCoding::Plain), "as it is");
  EXPECT_EQ(content_of(file, PageCoding::Gzip), "by gzip");
  EXPECT_EQ(content_of(file, PageCoding::Brotli), "by Brotli");
}

// RFC 9110, 13.1.2.
TEST(PageTags, AreComparedWeaklyAndWhole) {
  for (const char* field : {"\"a\"", "W/\"a\"", "\"b\", \"a\"", "\"b\" , W/\"a\"", "*"})
    EXPECT_TRUE(names_tag(field, "\"a\"")) << field;
  for (const char* field : {"", "a", "\"a", "\"A\"", "\"aa\"", "w/\"a\"", "W/W/\"a\"", ",", "**"})
    EXPECT_FALSE(names_tag(field, "\"a\"")) << field;
}

TEST(PagePolicy, AllowsOwnScriptsAndConnectionsAndNothingElse) {
  const std::string policy = page_policy("hair.example:7878");
  EXPECT_THAT(policy, HasSubstr("default-src 'none'"));
  EXPECT_THAT(policy, HasSubstr("script-src 'self' 'wasm-unsafe-eval';"));
  EXPECT_THAT(policy, HasSubstr("connect-src 'self' ws://hair.example:7878 wss://hair.example:7878;"));
  EXPECT_THAT(policy, HasSubstr("frame-ancestors 'none'"));
  EXPECT_THAT(policy, Not(HasSubstr("unsafe-inline")));
  EXPECT_THAT(policy, Not(HasSubstr("'unsafe-eval'")));
  EXPECT_THAT(policy, Not(HasSubstr("*")));
}

}  // namespace
}  // namespace strandcast::page_test
