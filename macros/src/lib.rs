//! The attributes `#[node]` of structs of ports and parameters, and `#[choice]` of enums that are parameters. Nodes use
//! them as `shibo_node::{choice, node}`.
use proc_macro::TokenStream;
use quote::{quote, quote_spanned};
use syn::spanned::Spanned;
use syn::{Data, DeriveInput, Error, Field, Fields, Result};

/// Derives the traits that a node needs, for a struct of ports and parameters.
///
/// The struct gets `Clone`, `Debug`, `Serialize`, `Deserialize`, `JsonSchema` and `Default`. A graph may leave out any
/// field, and an unknown field is an error. `#[default(VALUE)]` states the default of a field. A field without it takes
/// the default of its type: an unconnected port, 0, `false`, or an empty list.
///
/// ```ignore
/// /// Bumps of one size.
/// #[node]
/// pub struct Bumps {
///     /// Where bumps are.
///     pub mask: Option<In<Gray>>,
///     /// Size of a bump.
///     #[schemars(range(min = 0.1, max = 100), extend("unit" = "mm"))]
///     #[default(5.0)]
///     pub size: f64,
/// }
/// ```
#[proc_macro_attribute]
pub fn node(_: TokenStream, item: TokenStream) -> TokenStream {
    let item = syn::parse_macro_input!(item as DeriveInput);
    expand(item).unwrap_or_else(|error| error.into_compile_error().into())
}

/// Derives the traits that a parameter needs whose value is one of several names, for an enum. `#[default]` marks the
/// variant that is the default.
#[proc_macro_attribute]
pub fn choice(_: TokenStream, item: TokenStream) -> TokenStream {
    let item = proc_macro2::TokenStream::from(item);
    let code = quote! {
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        #[derive(::serde::Serialize, ::serde::Deserialize, ::schemars::JsonSchema)]
        #item
    };
    code.into()
}

fn expand(mut item: DeriveInput) -> Result<TokenStream> {
    let name = item.ident.clone();
    let Data::Struct(data) = &mut item.data else { return Err(Error::new(name.span(), "a node is a struct")) };
    let Fields::Named(fields) = &mut data.fields else {
        return Err(Error::new(name.span(), "ports and parameters have names"));
    };
    let names: Vec<_> = fields.named.iter().map(|field| field.ident.clone()).collect();
    let defaults = fields.named.iter_mut().map(take_default).collect::<Result<Vec<_>>>()?;
    let code = quote! {
        #[derive(Clone, Debug, ::serde::Serialize, ::serde::Deserialize, ::schemars::JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        #item

        impl ::core::default::Default for #name {
            fn default() -> Self {
                Self { #(#names: #defaults,)* }
            }
        }
    };
    Ok(code.into())
}

/// The default of a field. Its attribute is removed, because the compiler does not know it.
fn take_default(field: &mut Field) -> Result<proc_macro2::TokenStream> {
    match field.attrs.iter().position(|attribute| attribute.path().is_ident("default")) {
        Some(position) => Ok(field.attrs.remove(position).meta.require_list()?.tokens.clone()),
        None => Ok(quote_spanned!(field.ty.span() => ::core::default::Default::default())),
    }
}
