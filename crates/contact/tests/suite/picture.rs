//! The pictures in the documentation of the crate and in the book are the one that the example draws.

#[path = "../../examples/mortar_picture.rs"]
#[allow(dead_code)]
mod mortar_picture;

/// `UPDATE_PAGES=1` writes them.
#[test]
fn the_picture_is_the_examples() {
    let picture = mortar_picture::picture().expect("the surfaces are sound");
    for file in ["mortar.svg", "../../docs/figures/mortar.svg"] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        if std::env::var_os("UPDATE_PAGES").is_some() {
            std::fs::write(&path, &picture).expect("the folders of the pictures can be written");
        }
        assert_eq!(std::fs::read_to_string(path).expect(file), picture);
    }
}
