// What Boost.Asio and Boost.Beast do without templates of ours, compiled here once instead of in every file
// that includes them.
#include <boost/asio/impl/src.hpp>
#include <boost/asio/ssl/impl/src.hpp>
#include <boost/beast/src.hpp>
