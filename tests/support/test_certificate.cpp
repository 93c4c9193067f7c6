#include "tests/support/test_certificate.h"

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <cstdio>
#include <memory>

#include "common/base/check.h"

namespace strandcast::test {
namespace {

constexpr long kDayS = 86'400;

/// Writes through OpenSSL to a file that only its owner can read.
template <class Write>
void write_pem(const std::filesystem::path& path, Write write) {
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "w"), &std::fclose);
  CHECK(file != nullptr);
  CHECK(chmod(path.c_str(), 0600) == 0);
  CHECK(write(file.get()) == 1);
}

}  // namespace

TlsFiles make_certificate(const std::filesystem::path& folder, const std::string& name,
                          const CertificatePlan& plan) {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"), &EVP_PKEY_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(X509_new(), &X509_free);
  CHECK(key != nullptr && certificate != nullptr);
  X509_set_version(certificate.get(), X509_VERSION_3);
  ASN1_INTEGER_set(X509_get_serialNumber(certificate.get()), 1);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -10 * kDayS);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), plan.valid_s);
  X509_set_pubkey(certificate.get(), key.get());
  X509_NAME* const subject = X509_get_subject_name(certificate.get());
  X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC,
                             reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1, 0);
  X509_set_issuer_name(certificate.get(), subject);
  const std::unique_ptr<X509_EXTENSION, decltype(&X509_EXTENSION_free)> names(
      X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, plan.names.c_str()), &X509_EXTENSION_free);
  CHECK(names != nullptr);
  X509_add_ext(certificate.get(), names.get(), -1);
  CHECK(X509_sign(certificate.get(), key.get(), EVP_sha256()) > 0);

  const TlsFiles files{folder / (name + ".crt"), folder / (name + ".key")};
  write_pem(files.certificate, [&](FILE* file) { return PEM_write_X509(file, certificate.get()); });
  write_pem(files.key, [&](FILE* file) {
    return PEM_write_PrivateKey(file, key.get(), nullptr, nullptr, 0, nullptr, nullptr);
  });
  return files;
}

}  // namespace strandcast::test
