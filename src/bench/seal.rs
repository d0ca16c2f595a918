//! sealed = nonce ‖ XChaCha20-Poly1305(key, nonce, plain),  commitment = SHA-256(plain),  plain = JSON with a random
//! salt
//!
//! XChaCha20-Poly1305 (draft-irtf-cfrg-xchacha-03) is authenticated: another key or a changed byte is found out, and
//! its nonces of 24 bytes may be drawn at random. Without the salt the commitment could be guessed from likely labels.

use super::worlds::Label;
use crate::error::{Error, ErrorKind, Result};
use chacha20poly1305::aead::{Aead, Generate, KeyInit};
use chacha20poly1305::{Key, XChaCha20Poly1305, XNonce};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::Path;

/// Length of key and salt, bytes.
const KEY_LEN: usize = 32;
const NONCE_LEN: usize = 24;

/// The sealed content.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Labels {
    /// Random salt, so that the labels cannot be guessed from the commitment.
    pub salt: String,
    /// Seed of the cases.
    pub seed: u64,
    /// Label by name of the case.
    pub labels: BTreeMap<String, Label>,
}

/// The key to sealed labels.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct SealKey([u8; KEY_LEN]);

impl std::fmt::Debug for SealKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SealKey(..)")
    }
}

impl SealKey {
    /// A key from the system's random source.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] if the system has none.
    pub(crate) fn random() -> Result<Self> {
        Ok(Self(random_bytes()?))
    }

    /// 64 hexadecimal digits.
    #[must_use]
    pub(crate) fn to_hex(&self) -> String {
        hex(&self.0)
    }

    /// A key from its 64 hexadecimal digits; `input` is its file's name in messages.
    ///
    /// # Errors
    /// [`ErrorKind::Format`] for anything else.
    pub(crate) fn from_hex(text: &str, input: &str) -> Result<Self> {
        let text = text.trim();
        let digit = |i: usize| text.get(2 * i..2 * i + 2).and_then(|two| u8::from_str_radix(two, 16).ok());
        let bytes: Option<Vec<u8>> = (0..KEY_LEN).map(digit).collect();
        match bytes.and_then(|b| <[u8; KEY_LEN]>::try_from(b).ok()) {
            Some(bytes) if text.len() == 2 * KEY_LEN => Ok(Self(bytes)),
            _ => Err(Error::new(ErrorKind::Format, input, "is no key")
                .hint("a key is 64 hexadecimal digits, as gyroid gap bench make wrote them")),
        }
    }

    /// Reads a key file.
    ///
    /// # Errors
    /// [`ErrorKind::Io`], [`ErrorKind::Format`].
    pub(crate) fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, &e))?;
        Self::from_hex(&text, &path.display().to_string())
    }
}

/// Random bytes of the system.
pub(super) fn random_bytes() -> Result<[u8; KEY_LEN]> {
    Key::try_generate()
        .map(Into::into)
        .map_err(|e| Error::new(ErrorKind::Io, "bench", format!("the system's random source failed: {e}")))
}

pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// SHA-256 of the plain labels, in hexadecimal digits.
#[must_use]
pub(crate) fn commitment(plain: &[u8]) -> String {
    hex(&Sha256::digest(plain))
}

/// Sealed labels, and the commitment to them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Sealed {
    /// Nonce and ciphertext.
    pub bytes: Vec<u8>,
    /// SHA-256 of the plain labels.
    pub commitment: String,
}

/// Seals `labels` of cases made from `seed`.
///
/// # Errors
/// [`ErrorKind::Io`] if the system has no random numbers.
pub(crate) fn seal(labels: BTreeMap<String, Label>, seed: u64, key: &SealKey) -> Result<Sealed> {
    let labels = Labels { salt: hex(&random_bytes()?), seed, labels };
    let plain = serde_json::to_vec(&labels)
        .map_err(|e| Error::new(ErrorKind::Format, "labels", format!("cannot be written as JSON: {e}")))?;
    let nonce = XNonce::try_generate()
        .map_err(|e| Error::new(ErrorKind::Io, "bench", format!("the system's random source failed: {e}")))?;
    let cipher = XChaCha20Poly1305::new(&Key::from(key.0));
    let text = cipher
        .encrypt(&nonce, plain.as_slice())
        .map_err(|_| Error::new(ErrorKind::Numeric, "labels", "cannot be encrypted"))?;
    let mut bytes = nonce.to_vec();
    bytes.extend(text);
    Ok(Sealed { bytes, commitment: commitment(&plain) })
}

/// Opens sealed labels and holds them against the commitment; `input` is the file's name in messages.
///
/// # Errors
/// [`ErrorKind::Checksum`] if the key is another, a byte was changed, or the labels are not those of the commitment;
/// [`ErrorKind::Format`] if there are no labels inside.
pub(crate) fn unseal(bytes: &[u8], key: &SealKey, committed: &str, input: &str) -> Result<Labels> {
    let broken = || {
        Error::new(ErrorKind::Checksum, input, "does not open: the key is another, or the file was changed")
            .hint("take the key that gap bench make wrote for this folder, and the file as it was made")
    };
    let nonce: [u8; NONCE_LEN] = bytes.get(..NONCE_LEN).and_then(|n| n.try_into().ok()).ok_or_else(broken)?;
    let cipher = XChaCha20Poly1305::new(&Key::from(key.0));
    let plain = cipher.decrypt(&XNonce::from(nonce), &bytes[NONCE_LEN..]).map_err(|_| broken())?;
    let found = commitment(&plain);
    if found != committed.trim() {
        return Err(Error::new(ErrorKind::Checksum, input, format!("holds labels with the SHA-256 {found}"))
            .at(format!("commitment {}", committed.trim()))
            .hint("these are not the labels that were committed to: score the folder as it was made"));
    }
    serde_json::from_slice(&plain).map_err(|e| {
        Error::new(ErrorKind::Format, input, format!("holds no labels: {e}"))
            .hint("score the folder with the version of gyroid that made it")
    })
}
